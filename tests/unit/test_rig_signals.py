"""Raw signals of a rig: cage speeds, trains of impact pulses by closed forms, a simulated force read back, and bad signals."""

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from rig_signals import (
    Pulses,
    PulseSetting,
    cage_speed,
    impact_pulses,
    low_passed,
    pulse_sums,
    pulses_of,
    simulated_pulses,
    without_echoes,
)

from rbdyn.base.faults import InputError
from rbdyn.dynamics.motion import history
from rbdyn.scene import Scene

EXAMPLE = Path(__file__).parents[2] / "examples" / "cylindrical_roller.toml"
OUTPUTS = ("pulse_rate_hz", "pulse_height_N", "pulse_impulse_N_s")
RATE, BANDWIDTH, THRESHOLD = 200_000.0, 10_000.0, 10.0


def half_sines(starts: Any, heights: Any, width: float, seconds: float, rate: float = RATE) -> tuple[Any, Any]:
    """Times, and a force that is zero but for half sines of a width [s] from ``starts`` [s] on."""
    time = np.arange(round(seconds * rate)) / rate
    force = np.zeros(time.size)
    for start, height in zip(starts, heights, strict=True):
        first, last = np.searchsorted(time, [start, start + width])
        force[first:last] = height * np.sin(np.pi * (time[first:last] - start) / width)
    return time, force


def written(folder: Path, *columns: Any, header: str = "t_s,force_N", name: str = "trace.csv") -> Path:
    """A file of a signal."""
    np.savetxt(folder / name, np.column_stack(columns), "%.9g", ",", header=header, comments="")
    return folder / name


def test_long_pulses_keep_height_impulse_and_time() -> None:
    """Half sines of 1 ms below 10 kHz lose 1 - pi^2 s^2/(2 w^2) of their height, s the spread of the filter."""
    width, starts, heights = 1e-3, np.array([0.01, 0.02, 0.031]), np.array([50.0, 80.0, 30.0])
    _, force = half_sines(starts, heights, width, 0.05)
    pulses = pulses_of(low_passed(force, RATE, BANDWIDTH), RATE, 1.0, 0.0)
    spread = np.sqrt(np.log(2.0)) / (2.0 * np.pi * BANDWIDTH)
    assert pulses.height == pytest.approx(heights * np.exp(-0.5 * (np.pi * spread / width) ** 2), rel=1e-4)
    assert pulses.time == pytest.approx(starts + 0.5 * width, abs=0.2 / RATE)
    assert pulses.impulse == pytest.approx(2.0 * heights * width / np.pi, rel=2e-3)


@pytest.mark.parametrize("rate", [100_000.0, RATE, 1_000_000.0])
def test_short_pulses_get_the_height_of_their_impulse(rate: float) -> None:
    """A pulse far shorter than the bandwidth has the height J f sqrt(2 pi/ln 2), whatever its own height."""
    impulse = 4e-3
    force = np.zeros(round(0.01 * rate))
    force[len(force) // 2] = impulse * rate
    pulses = pulses_of(low_passed(force, rate, BANDWIDTH), rate, 1e-3, 0.0)
    assert pulses.height == pytest.approx([impulse * BANDWIDTH * np.sqrt(2.0 * np.pi / np.log(2.0))], rel=2e-3)
    assert pulses.impulse == pytest.approx([impulse], rel=2e-3)


def test_too_few_samples_underestimate_a_height() -> None:
    """Samples at twice the width of unfiltered half sines see at most their share, on average 1/pi of the height."""
    starts = np.arange(1, 400) * 1.2345e-3
    _, force = half_sines(starts, np.full(399, 60.0), 1e-4, 0.5, 5_000.0)
    sizes = force[(starts * 5_000.0).astype(int) + 1]
    assert sizes.mean() == pytest.approx(60.0 / np.pi, rel=0.1)


def test_unit_a_pulse_at_an_end_is_left_out_and_both_signs_count() -> None:
    """Unit: stretches that the record cuts have no height of their own."""
    force = np.array([20.0, 20.0, 0.0, -5.0, -30.0, -5.0, 0.0, 12.0, 0.0, 40.0])
    pulses = pulses_of(force, 1.0, 10.0, 0.0)
    assert pulses.time.tolist() == [4.0, 7.0]
    # On straight lines from crossing to crossing: two pieces of 0.8 from 10 to 30, and of 2/12 from 10 to 12.
    assert pulses.impulse == pytest.approx([2 * 0.8 * 20.0, 2 * (2.0 / 12.0) * 11.0])
    assert pulses_of(np.full(9, 50.0), 1.0, 10.0, 0.0).time.size == 0
    assert pulses_of(np.zeros(9), 1.0, 10.0, 0.0).time.size == 0


def test_unit_the_dead_time_joins_echoes() -> None:
    """Unit: it starts at a pulse and is not prolonged by those within it."""
    pulses = Pulses(np.array([0.0, 0.6, 1.1, 1.5, 4.0]), np.array([3.0, 9.0, 4.0, 2.0, 1.0]), np.full(5, 0.5))
    joined = without_echoes(pulses, 1.0)
    assert joined.time.tolist() == [0.0, 1.1, 4.0]
    assert joined.height.tolist() == [9.0, 4.0, 1.0] and joined.impulse.tolist() == [1.0, 1.0, 0.5]
    assert without_echoes(pulses, 0.0) is pulses
    sums = pulse_sums(pulses, np.array([1.0, 2.0, 3.0, 4.0]))
    assert sums[:, 0].tolist() == [2.0, 2.0, 0.0, 1.0] and sums[:, 1].tolist() == [12.0, 6.0, 0.0, 1.0]


@pytest.fixture(scope="module")
def train() -> tuple[Any, Any, Any]:
    """A trace of 300 half sines of 0.4 ms at random, with heights and the noise of a sensor."""
    random = np.random.default_rng(3)
    starts = np.cumsum(random.uniform(1e-3, 3e-3, 300))
    heights = random.uniform(20.0, 100.0, 300)
    time, force = half_sines(starts, heights, 4e-4, float(starts[-1]) + 2e-3, 100_000.0)
    return time, force + 0.5 * random.standard_normal(force.size), heights


@pytest.mark.parametrize("kind", ["impact_force", "impact_acceleration", "impact_pulses"])
def test_a_train_of_pulses_is_recovered_within_its_error(tmp_path: Path, train: Any, kind: str) -> None:
    time, force, heights = train
    rate = 300 / time[-1]
    setting = PulseSetting(THRESHOLD, BANDWIDTH, 0.0)
    if kind == "impact_pulses":
        pulses = pulses_of(low_passed(force, 1e5, BANDWIDTH), 1e5, 1.0 * THRESHOLD, 0.0)
        path = written(tmp_path, pulses.time, 1e-3 * pulses.height, header="t_s,height_kN")
    elif kind == "impact_acceleration":
        path, setting = written(tmp_path, time, force / 0.2, header="t_s,acceleration_m_s2"), setting._replace(mass=0.2)
    else:
        path = written(tmp_path, time, force)
    means, note = impact_pulses(path, kind, setting)
    assert note is None and set(means) == set(OUTPUTS[: 2 if kind == "impact_pulses" else 3])
    assert abs(means["pulse_rate_hz"].value - rate) < 4.0 * means["pulse_rate_hz"].sd < 0.1 * rate
    # Of the scatter of the heights, uniform from 20 to 100 N, among 300 pulses.
    height = means["pulse_height_N"]
    assert height.value == pytest.approx(heights.mean() * np.exp(-0.5 * (np.pi * 0.13253e-4 / 4e-4) ** 2), rel=4e-3)
    assert height.sd == pytest.approx(80.0 / np.sqrt(12.0 * 300.0), rel=0.4)
    if kind != "impact_pulses":
        # Less what lies below the threshold at the ends, of a pulse of height h: h - sqrt(h^2 - 100 N^2).
        impulse = 2.0 * 4e-4 / np.pi * np.sqrt(heights**2 - THRESHOLD**2).mean()
        assert means["pulse_impulse_N_s"].value == pytest.approx(impulse, rel=0.01)


def test_a_simulated_force_read_back_as_a_signal_gives_the_figures_of_the_motion(tmp_path: Path) -> None:
    """The pockets one after the other as one trace, of half as many samples in a period of the bandwidth."""
    scene, setting = Scene.load(EXAMPLE), PulseSetting(10.0, 5000.0, 1e-4)
    motion = history(scene, 40.0, samples_per_turn=125)
    path = written(tmp_path, motion.time, motion.pocket_load[:, 0])
    with pytest.raises(InputError, match="at least 100 are needed, so measure longer or lower it"):
        impact_pulses(path, "impact_force", setting)
    joined = np.concatenate(motion.pocket_load.T)
    path = written(tmp_path, np.arange(joined.size) * scene.turn_s / 125, joined)
    means, _ = impact_pulses(path, "impact_force", setting)
    expected = simulated_pulses(scene, 40.0, setting)
    assert expected.keys() == means.keys() and expected["pulse_height_N"] > 10.0
    for name, value in expected.items():
        assert means[name].value == pytest.approx(value, rel=0.05)


@pytest.mark.parametrize(
    ("kind", "change", "sentence"),
    [
        ("impact_force", {"header": "t_s,force"}, "column force_N or force_kN is missing; add it"),
        ("impact_force", {"bandwidth": 10_010.0}, "1e+05 samples a second are fewer than 10 a period of bandwidth_hz = 10010"),
        ("impact_force", {"threshold": 99.9}, "above threshold_N = 99.9; at least 100 are needed"),
        ("impact_force", {"uneven": True}, "t_s does not rise evenly; give samples at equal intervals"),
        ("impact_pulses", {"header": "t_s,height_N", "reverse": True}, "t_s does not rise from pulse to pulse"),
    ],
)  # fmt: skip
def test_bad_traces_end_in_a_sentence(tmp_path: Path, train: Any, kind: str, change: Any, sentence: str) -> None:
    time, force = (column[:40_000] for column in train[:2])
    rows = np.delete(np.arange(time.size), 700 if change.get("uneven") else [])
    rows = rows[::-1] if change.get("reverse") else rows
    path = written(tmp_path, time[rows], force[rows], header=change.get("header", "t_s,force_N"))
    setting = PulseSetting(change.get("threshold", THRESHOLD), change.get("bandwidth", BANDWIDTH), 0.0)
    with pytest.raises(InputError) as error:
        impact_pulses(path, kind, setting)
    assert len(error.value.faults) == 1 and sentence in error.value.faults[0]


def test_noise_a_clipped_sensor_and_short_pulses_are_noted(tmp_path: Path, train: Any) -> None:
    time, force, _ = train
    noisy = force + 20.0 * np.random.default_rng(1).standard_normal(force.size)
    _, note = impact_pulses(written(tmp_path, time, noisy), "impact_force", PulseSetting(THRESHOLD, BANDWIDTH, 1e-3))
    assert note is not None and "threshold_N = 10 is below 4 times the background of" in note
    clipped = np.minimum(force, 60.0)
    _, note = impact_pulses(written(tmp_path, time, clipped), "impact_force", PulseSetting(THRESHOLD, BANDWIDTH, 0.0))
    assert note is not None and "are the largest one, 60 N; the sensor may be at the end of its range" in note
    _, note = impact_pulses(written(tmp_path, time, force), "impact_force", PulseSetting(5.0, 500.0, 0.0))
    assert note is not None and "so their height shows the impulse, not the stiffness" in note


def _signal(folder: Path, name: str, lines: Sequence[str]) -> Path:
    (folder / name).write_text("\n".join(lines) + "\n", "utf-8")
    return folder / name


def test_pulses_of_an_uneven_wheel_give_the_mean_speed_with_its_error(tmp_path: Path) -> None:
    random = np.random.default_rng(3)
    # Turns of a cage at 9400 rpm that scatter by 1 %, three uneven marks a turn, three of a turn lost.
    turns = 60.0 / (9400.0 * (1.0 + 0.01 * random.standard_normal(400)))
    starts = np.concatenate([[0.0], np.cumsum(turns)])
    marks = (starts[:-1, None] + turns[:, None] * [0.0, 0.31, 0.69]).ravel()
    path = _signal(tmp_path, "pulses.csv", ["t_s", *map(str, marks.tolist())])
    value, sd, told = cage_speed(path, "cage_pulses", 3)
    assert value == pytest.approx(60.0 * 399 / starts[399], rel=1e-9) and told is None
    assert sd == pytest.approx(0.01 * 9400.0 / np.sqrt(399.0), rel=0.3)
    lost = np.delete(marks, slice(300, 303))
    value, _, told = cage_speed(_signal(tmp_path, "lost.csv", ["t_s", *map(str, lost.tolist())]), "cage_pulses", 3)
    assert value == pytest.approx(9400.0, rel=2e-3) and told is not None and "1 of 398 turns lack pulses" in told


def test_a_speed_signal_remembers_and_its_error_knows(tmp_path: Path) -> None:
    random, speed = np.random.default_rng(4), [9400.0]
    for _ in range(20_000):
        speed.append(9400.0 + 0.98 * (speed[-1] - 9400.0) + 5.0 * random.standard_normal())
    lines = [f"{0.001 * place:.4f},{value!r}" for place, value in enumerate(speed)]
    value, sd, _ = cage_speed(_signal(tmp_path, "speed.csv", ["t_s,cage_speed_rpm", *lines]), "cage_speed", 1)
    # Variance of the mean of an autoregression: s^2/((1 - r)^2 n).
    assert sd == pytest.approx(5.0 / 0.02 / np.sqrt(20_000.0), rel=0.25)
    assert value == pytest.approx(9400.0, abs=3.0 * sd)
