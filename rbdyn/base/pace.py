"""What a command states of the time of its runs: one estimate, after the first of them."""

from collections.abc import Callable, Sequence

# Function that takes a sentence on the runs; None where nobody listens.
Notice = Callable[[str], object] | None
# A shorter time [s] needs no sentence; a time above LONG_S needs one that says how to make the plan smaller.
NOTABLE_S, LONG_S = 5.0, 600.0


def estimate(seconds: float, keys: Sequence[str]) -> str:
    """'the rest takes about 12 min; reduce numerics.turns to shorten it': the time to come, with what shortens a long one."""
    sentence = f"the rest takes about {duration(seconds)}"
    return f"{sentence}; reduce {any_of(keys)} to shorten it" if keys and seconds >= LONG_S else sentence


def named(notice: Notice, name: str) -> Notice:
    """A notice whose sentences begin with the name of one of several simulations."""
    return None if notice is None else lambda sentence: notice(f"{name}: {sentence}")


def part_of(progress: Callable[[int, int], None] | None, place: int, count: int) -> Callable[[int, int], None] | None:
    """Progress of one of ``count`` simulations as that of all, where each has as many runs."""
    return None if progress is None else lambda done, total: progress(place * total + done, count * total)


def duration(seconds: float) -> str:
    """A time to two digits in a suitable unit."""
    for unit, size in (("days", 86400.0), ("h", 3600.0), ("min", 60.0), ("s", 1.0)):
        if seconds >= 2.0 * size:
            return f"{float(f'{seconds / size:.2g}'):g} {unit}"
    return f"{seconds:.2g} s"


def any_of(words: Sequence[str]) -> str:
    """'a, b or c'."""
    return f"{', '.join(words[:-1])} or {words[-1]}" if words[1:] else words[0]
