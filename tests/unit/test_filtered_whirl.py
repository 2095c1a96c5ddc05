"""Filtered whirl: tests by closed forms, by a simulated orbit read back as a rig's signal, and of bad signals."""

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from rig_signals import whirl
from scipy.special import ellipe

from doe.workflow.calibration import cases_of
from doe.workflow.input_sets import case_of
from doe.workflow.rig import read_rig
from rbdyn.base.faults import InputError, read_toml
from rbdyn.dynamics.ensemble import Stop
from rbdyn.dynamics.figures import WHIRL_DEVIATION_RATIO
from rbdyn.dynamics.motion import history
from rbdyn.dynamics.parameters.model import roller_bearing
from rbdyn.dynamics.recording import record
from rbdyn.dynamics.run import Run
from rbdyn.dynamics.statistics.metrics import filtered_speed
from rbdyn.dynamics.statistics.replicate import Replicate
from rbdyn.scene import Scene

EXAMPLE = Path(__file__).parents[2] / "examples" / "cylindrical_roller.toml"
RATE, CUTOFF = 20_000.0, 500.0
# Two circles of speeds 30 and 12 mm/s, and how the speed of both together deviates.
SLOW, FAST = (40.0, 0.030), (90.0, 0.012)


def _orbit(seconds: float, circles: Sequence[tuple[float, float]], rate: float = RATE) -> tuple[np.ndarray, np.ndarray]:
    """Times, and places of motions in circles of a frequency and a speed each."""
    time = np.arange(round(seconds * rate)) / rate
    angles = [2.0 * np.pi * frequency for frequency, _ in circles]
    place = sum(
        speed / angle * np.array([np.cos(angle * time), np.sin(angle * time)])
        for angle, (_, speed) in zip(angles, circles, strict=True)
    )
    return time, np.asarray(place)


def _ratio(a: float, b: float) -> float:
    """Of |a + b e^(i phi)|: mean square a^2 + b^2, mean 2/pi (a + b) E(4 a b/(a + b)^2)."""
    mean = 2.0 / np.pi * (a + b) * ellipe(4.0 * a * b / (a + b) ** 2)
    return float(np.sqrt((a * a + b * b) / mean**2 - 1.0))


def _file(
    folder: Path, time: np.ndarray, place: np.ndarray, name: str = "orbit.csv", header: str = "t_s,x_um,y_um"
) -> Path:
    lines = [f"{t:.9f},{1e6 * x + 30.0:.9g},{1e6 * y - 7.0:.9g}" for t, x, y in zip(time, *place, strict=True)]
    (folder / name).write_text("\n".join([header, *lines]) + "\n", "utf-8")
    return folder / name


def test_two_circles_deviate_by_the_closed_form_whatever_is_above_the_cutoff_or_notched() -> None:
    expected = _ratio(SLOW[1], FAST[1])
    assert expected == pytest.approx(0.2676, abs=1e-4)
    for more, notches in (([], ()), ([(3000.0, 0.02)], ()), ([(157.0, 0.02)], (157.0,)), ([], (5000.0,))):
        _, place = _orbit(4.0, [SLOW, FAST, *more])
        speed = filtered_speed(place, RATE, CUTOFF, notches)[int(RATE) : -int(RATE)]
        # A notch at 157 Hz takes a little of what goes round at 90 Hz.
        assert speed.std() / speed.mean() == pytest.approx(expected, rel=0.01 if 157.0 in notches else 1e-4)
    _, place = _orbit(4.0, [SLOW, FAST, (157.0, 0.02)])
    speed = filtered_speed(place, RATE, CUTOFF, ())
    assert speed.std() / speed.mean() > 1.3 * expected


def test_the_sampling_rate_hardly_matters() -> None:
    expected = _ratio(0.030, 0.025)
    ratios = []
    for rate in (5_000.0, 50_000.0):
        _, place = _orbit(2.0, [SLOW, (300.0, 0.025)], rate)
        speed = filtered_speed(place, rate, CUTOFF, ())[int(0.2 * rate) : -int(0.2 * rate)]
        ratios.append(speed.std() / speed.mean())
    assert ratios[0] == pytest.approx(ratios[1], rel=2e-3) and ratios[0] == pytest.approx(expected, rel=0.02)


def test_unit_a_notch_that_a_record_cannot_tell_takes_nothing_out() -> None:
    """Unit: a frequency of fewer than ten periods in the record leaves the speed as it is, to the last bit."""
    _, place = _orbit(0.3, [SLOW, FAST])
    for slow in (1e-12, 1e-3, 33.0):
        assert (filtered_speed(place, RATE, CUTOFF, (slow,)) == filtered_speed(place, RATE, CUTOFF, ())).all()
    assert (filtered_speed(place, RATE, CUTOFF, (34.0,)) != filtered_speed(place, RATE, CUTOFF, ())).any()


def test_unit_a_cutoff_has_a_period_in_the_run(filtered: Scene) -> None:
    """Unit: a low pass slower than the whole run has no filter; the scene says so before anything runs."""
    with pytest.raises(
        InputError, match=r"whirl_cutoff_hz = 1e-09: its period is longer than the run of 0\.35 s; raise it"
    ):
        filtered.changed({"numerics.whirl_cutoff_hz": 1e-9})


def test_nothing_fast_comes_through_at_the_ends() -> None:
    _, place = _orbit(0.3, [SLOW, FAST])
    _, noisy = _orbit(0.3, [SLOW, FAST, (1700.0, 0.15)])
    clean, speed = (filtered_speed(each, RATE, CUTOFF, ()) for each in (place, noisy))
    assert np.abs(speed - clean).max() < 0.02 * clean.mean()


def test_a_still_record_takes_the_noise_out(tmp_path: Path) -> None:
    random = np.random.default_rng(5)
    time, place = _orbit(1.5, [SLOW, FAST])
    # After the filter 3.6 mm/s in each component.
    noise = 1e-5 * random.standard_normal((2, *place.shape))
    path = _file(tmp_path, time, place + noise[0])
    still = _file(tmp_path, time, noise[1], "still.csv")
    expected = _ratio(SLOW[1], FAST[1])
    raw, _, told = whirl(path, CUTOFF, (), None)
    assert raw > 1.06 * expected and told is not None and "without a still_file" in told
    value, sd, told = whirl(path, CUTOFF, (), still)
    assert value == pytest.approx(expected, rel=0.015) and abs(value - expected) < 4.0 * sd and told is None
    with pytest.raises(InputError, match=r"still\.csv: has more than 25 % of the mean square speed of orbit\.csv"):
        whirl(path, CUTOFF, (), _file(tmp_path, time, 4.0 * noise[1], "still.csv"))


def test_unit_runout_that_stays_in_is_noted(tmp_path: Path) -> None:
    """Unit: a shaft that turns fewer than ten times in the orbit is named with its frequency."""
    path = _file(tmp_path, *_orbit(3.0, [SLOW, FAST]))
    whole, slow = (whirl(path, CUTOFF, notches, None) for notches in ((), (1.0 / 60.0,)))
    assert slow[:2] == whole[:2]
    assert (
        slow.note is not None and "runout at 0.0166667 Hz counts as whirl, of which it has fewer than 10" in slow.note
    )


@pytest.fixture
def filtered() -> Scene:
    changes: dict[str, Any] = {"turns": 140.0, "discard_turns": 0.0, "replicates": 1, "whirl_cutoff_hz": 800.0}
    return Scene.load(EXAMPLE).changed({f"numerics.{key}": value for key, value in changes.items()})


def _counted(scene: Scene) -> Replicate:
    """Its one run from the twentieth turn on."""
    return record(Run(scene, roller_bearing(scene), 0, scene.numerics.rtol, Stop())).counted_from(20)


def test_a_simulated_orbit_read_back_as_a_signal_is_the_statistic_of_the_run(tmp_path: Path, filtered: Scene) -> None:
    plain = filtered.changed({"numerics.whirl_cutoff_hz": None})
    assert plain.whirl_samples_per_turn == 0 and filtered.whirl_samples_per_turn == 20
    motion = history(filtered, 140.0, samples_per_turn=20)
    kept = _counted(filtered)
    path = _file(tmp_path, motion.time[400:], np.array([motion.cage_x, motion.cage_y])[:, 400:])
    value, sd, _ = whirl(path, 800.0, (), None)
    # Batches of the run end at samples, so both integrate the same steps; the run has one sample more.
    assert kept.whirl[:, 0].sum() == 2801 == len(motion.time) + 1
    assert value == pytest.approx(WHIRL_DEVIATION_RATIO.value(kept), rel=5e-3)
    # The filter matters more than the error.
    assert abs(value - WHIRL_DEVIATION_RATIO.value(_counted(plain))) > 5.0 * sd
    notched = _counted(filtered.changed({"numerics.whirl_notches_hz": [400.0]}))
    assert WHIRL_DEVIATION_RATIO.value(notched) == pytest.approx(whirl(path, 800.0, (400.0,), None)[0], rel=0.02)
    assert (notched.work == kept.work).all()


def test_a_cutoff_far_above_all_motion_is_no_filter(filtered: Scene) -> None:
    scene = filtered.changed({"numerics.turns": 10.0, "numerics.whirl_cutoff_hz": 80_000.0})
    motion = history(scene, 10.0, samples_per_turn=scene.whirl_samples_per_turn)
    speed = filtered_speed(np.array([motion.cage_x, motion.cage_y]), 10.0 * 80_000.0, 80_000.0, ())
    integrated = np.hypot(motion.cage_vx, motion.cage_vy)
    assert np.abs(speed - integrated)[200:-200].max() < 0.02 * integrated.max()


def test_a_column_of_the_cutoff_filters_the_runs_of_its_row(tmp_path: Path) -> None:
    header = "operation.inner_speed_rpm,numerics.whirl_cutoff_hz,whirl_deviation_ratio,whirl_deviation_ratio_sd"
    rows = ["12000,500,0.3,0.01", "18000,400,0.3,0.01", "24000,400,0.4,0.01"]
    (tmp_path / "rig.csv").write_text("\n".join([header, *rows]), "utf-8")
    rig = read_rig(tmp_path / "rig.csv")
    declared = {"uncertain": {"defaults": "none", "cage.mass_g": {"law": "uniform", "low": 40.0, "high": 50.0}}}
    case = case_of("scene", read_toml(EXAMPLE) | declared, rig.outputs)
    assert [condition.scene.numerics.whirl_cutoff_hz for condition in cases_of(case, rig)] == [500.0, 400.0, 400.0]


@pytest.mark.parametrize(
    ("change", "sentence"),
    [
        ({"header": "t_s,x_um,z_um"}, "column y_um or y_m is missing; add it"),
        ({"uneven": True}, "t_s does not rise evenly"),
        ({"cutoff": 2001.0}, "fewer than 10 a period of cutoff_hz = 2001; sample faster or give 2000 at most"),
        ({"cutoff": 15_000.0}, "fewer than 10 a period of cutoff_hz = 15000"),
        ({"cutoff": 50.0}, "shorter than 200 periods of cutoff_hz = 50"),
        ({"cutoff": 1e-9}, "shorter than 200 periods of cutoff_hz = 1e-09; measure longer or raise it"),
        ({"header": "t_s,x_um,x_m"}, "columns x_um and x_m are both there; keep one"),
        ({"cell": "1e200"}, "x_um in row 2 = 1e200: is beyond 1e+12; check the unit"),
        ({"cell": "1e400"}, "x_um in row 2 = 1e400: is not a finite number"),
        ({"cell": "9" * 5000}, "is longer than 400 characters; write a shorter number"),
        ({"circles": [(40.0, 0.0)]}, "varies no more than noise"),
    ],
)
def test_bad_orbits_end_in_a_sentence(tmp_path: Path, change: dict[str, Any], sentence: str) -> None:
    time, place = _orbit(0.5, change.get("circles", [SLOW, FAST]))
    kept = np.delete(np.arange(len(time)), 700 if change.get("uneven") else [])
    path = _file(tmp_path, time[kept], place[:, kept], header=change.get("header", "t_s,x_um,y_um"))
    if "cell" in change:
        lines = path.read_text("utf-8").splitlines()
        lines[2] = ",".join([lines[2].split(",")[0], change["cell"], lines[2].split(",")[2]])
        path.write_text("\n".join(lines), "utf-8")
    with pytest.raises(InputError) as error:
        whirl(path, change.get("cutoff", CUTOFF), (), None)
    assert sentence in error.value.faults[0] and len(error.value.faults) <= 2


def test_notches_need_a_filter_and_a_cutoff_its_samples(filtered: Scene) -> None:
    with pytest.raises(InputError, match=r"a notch needs the filter of numerics\.whirl_cutoff_hz"):
        filtered.changed({"numerics.whirl_cutoff_hz": None, "numerics.whirl_notches_hz": [9.0]})
    with pytest.raises(InputError, match=r"whirl_cutoff_hz = 1e\+08: needs 3\.5e\+08 samples a replicate"):
        filtered.changed({"numerics.whirl_cutoff_hz": 1e8})
