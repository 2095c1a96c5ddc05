"""How long the rest takes: by a clock that the test sets."""

from __future__ import annotations

import heapq

import pytest

from rbdyn.base.forecast import Remaining, clock_words


def ends_of(runs: int, seconds: float, workers: int, compile_s: float) -> list[float]:
    """When runs of so many seconds end that go side by side after something was compiled."""
    free, ends = [compile_s] * workers, []
    for _ in range(runs):
        ends.append(heapq.heappop(free) + seconds)
        heapq.heappush(free, ends[-1])
    return sorted(ends)


@pytest.mark.parametrize("seconds", [0.5, 60.0, 600.0])
@pytest.mark.parametrize("workers", [1, 2, 4])
@pytest.mark.parametrize("before", [0, 7])
def test_unit_remaining_time_is_known_from_the_second_run_on(seconds, workers, before):
    """Unit: of runs of any length, side by side or not, and of those that were there before, it is within 20 % at each end."""
    now = [0.0]
    remaining, ends = Remaining(workers, lambda: now[0]), ends_of(10, seconds, workers, 0.0)
    remaining.update(before, before + 10)
    for done, (end, following) in enumerate(zip(ends, [*ends[1:], ends[-1]], strict=True), before + 1):
        now[0] = end
        remaining.update(done, before + 10)
        if done == before + 1:
            assert remaining.seconds is None
            continue
        assert remaining.seconds == pytest.approx(ends[-1] - end, rel=0.2, abs=1e-9)
        # It goes down between the ends, too.
        now[0] = end + 0.3 * (following - end)
        assert remaining.seconds == pytest.approx(ends[-1] - now[0], rel=0.2, abs=1e-9)


@pytest.mark.parametrize(("workers", "from_run"), [(1, 2), (2, 3), (4, 5)])
def test_unit_first_compilation_does_not_count(workers, from_run):
    """Unit: 30 s before runs of 2 s are forgotten as soon as runs have ended that began when others ended."""
    now = [0.0]
    remaining, ends = Remaining(workers, lambda: now[0]), ends_of(20, 2.0, workers, 30.0)
    remaining.update(0, 20)
    for done, end in enumerate(ends, 1):
        now[0] = end
        remaining.update(done, 20)
        if done >= from_run:
            assert remaining.seconds == pytest.approx(ends[-1] - end, rel=0.2, abs=1e-9)


def test_unit_runs_reported_in_chunks_and_overdue_ones_have_a_remaining_time():
    """Unit: a thousand at a time, and one that takes longer than the others; more to do than before."""
    now = [0.0]
    remaining = Remaining(1, lambda: now[0])
    for chunk in range(1, 6):
        now[0] = 2.0 * chunk
        remaining.update(1000 * chunk, 10_000)
    assert remaining.seconds == pytest.approx(10.0, rel=0.01)
    now[0] = 12.0
    assert remaining.seconds == pytest.approx(10.0, rel=0.01)
    remaining.update(5000, 20_000)
    assert remaining.seconds == pytest.approx(30.0, rel=0.01)


def test_unit_remaining_time_in_words():
    """Unit: hours, minutes, seconds; dashes before anything is known."""
    assert [clock_words(each) for each in (None, 0.0, 59.6, 3725.0, 90000.0)] == [
        "-:--:--", "0:00:00", "0:01:00", "1:02:05", "25:00:00",
    ]  # fmt: skip


def test_unit_bar_shows_the_time_left_of_runs_longer_than_half_a_minute(monkeypatch):
    """Unit: the bar of a terminal, on a clock that goes a minute a run."""
    import io
    import sys

    from rbdyn.base import command as remaining

    class Screen(io.StringIO):
        def isatty(self) -> bool:
            return True

    now, screen, clocked = [0.0], Screen(), remaining.Remaining
    monkeypatch.setattr(sys, "stderr", screen)
    monkeypatch.setenv("TERM", "xterm")
    monkeypatch.setattr(remaining, "Remaining", lambda workers: clocked(workers, lambda: now[0]))
    with remaining.progress_bar("simulating", quiet=False) as progress:
        for done in range(4):
            now[0] = 60.0 * done
            progress(done, 10)
    assert "3/10" in screen.getvalue() and "0:07:00" in screen.getvalue()
