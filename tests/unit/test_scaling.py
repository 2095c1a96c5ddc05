"""How run time grows: scenes enlarged and cut as they should be, fits, files, the command."""

from __future__ import annotations

import json
import subprocess
import sys

import numpy as np
import pytest
from conftest import ROOT, lacking
from scaling import Memory, Point, Scaling, fit, peak_memory, report, scaling, with_rollers, with_slices

from rbdyn.accuracy import write
from rbdyn.base.faults import InputError
from rbdyn.dynamics.parameters.model import roller_bearing
from rbdyn.dynamics.run import prepare

SOME = (10, 20)


@pytest.fixture(scope="module")
def found(outer):
    """Two bearings of 10 and 20 rollers; the plain law and, uncut still, no slices; memory over two lengths."""
    return scaling(outer, SOME, (1,), memory_turns=())


def test_unit_a_larger_bearing_keeps_what_a_roller_meets(outer):
    """Unit: twice the rollers at the same distance, under the same load each, at the same speed of the pitch circle."""
    larger = with_rollers(outer, 20)
    assert larger.bearing.rollers == 20
    assert larger.operation.radial_load_N / 20 == pytest.approx(outer.operation.radial_load_N / 10)
    chords = [scene.bearing.pitch_diameter_mm * np.pi / scene.bearing.rollers for scene in (outer, larger)]
    assert chords[0] == pytest.approx(chords[1])
    speeds = [scene.operation.speeds[0] * scene.bearing.pitch_diameter for scene in (outer, larger)]
    assert speeds[1] == pytest.approx(speeds[0])
    assert roller_bearing(larger).cage.mass == pytest.approx(2.0 * roller_bearing(outer).cage.mass)


def test_unit_slices_cut_the_roller(outer):
    """Unit: so many slices share the load; one is the plain law."""
    contact = roller_bearing(with_slices(outer, 11)).outer.contact
    assert np.count_nonzero(contact.share) == 11 and contact.share.sum() == pytest.approx(1.0)
    assert type(roller_bearing(with_slices(outer, 1)).outer.contact) is type(roller_bearing(outer).outer.contact)


def test_unit_what_cannot_be_scaled_is_refused(make_scene):
    """Unit: errors of single rollers and schedules are named."""
    errors = make_scene("bearing.roller_diameter_errors_um=[0,1,0,0,0,0,0,0,0,0]".replace("0,", "0.0,"))
    with pytest.raises(InputError, match="roller_diameter_errors_um"):
        with_rollers(errors, 20)
    scheduled = make_scene("operation.schedule={time_s=[0.0],radial_load_N=[100.0]}")
    with pytest.raises(InputError, match=r"operation\.schedule"):
        with_rollers(scheduled, 20)
    with pytest.raises(InputError, match=r"model\.slices"):
        with_slices(make_scene("bearing.roller_profile=logarithmic"), 1)


def test_unit_fit_finds_a_line_and_a_power():
    """Unit: exact for points on either; a whole roller does not count among the slices."""
    line = fit([Point(n, 300.0 + 50.0 * n, 0.0, 0.0, 0.0) for n in (10, 20, 50)])
    assert (line.fixed_ns, line.each_ns, line.r2) == pytest.approx((300.0, 50.0, 1.0))
    power = fit([Point(1, 7.0, 0.0, 0.0, 0.0), *(Point(n, 2.0 * n**1.5, 0.0, 0.0, 0.0) for n in (4, 9, 16))])
    assert power.exponent == pytest.approx(1.5)


def test_unit_times_are_measured_and_written(found, tmp_path, drawn):
    """Unit: a point a size; twice the rollers take more right-hand sides a turn, which is twice as long."""
    ten, twenty = found.points["rollers"]
    assert (ten.size, twenty.size) == SOME and [point.size for point in found.points["slices"]] == [1]
    assert ten.rhs_ns > 0.0 and 1.6 < twenty.rhs_per_turn / ten.rhs_per_turn < 2.4
    assert ten.turn_ms == pytest.approx(ten.rhs_ns * ten.rhs_per_turn * 1e-6)
    whole = Scaling({**found.points, "slices": list(found.points["rollers"])}, [Memory(4, 100.0), Memory(8, 100.0)])
    assert write(report(whole), tmp_path) == ["scaling.json", "scaling.csv", "scaling.png"]
    saved = json.loads((tmp_path / "scaling.json").read_text())
    assert saved["format"] == "rbdyn.scaling/1" and set(saved["fits"]) == {"rollers", "slices"}
    assert not lacking(drawn["scaling.png"], [[point.size, 1e-3 * point.rhs_ns] for point in found.points["rollers"]])
    assert len((tmp_path / "scaling.csv").read_text().splitlines()) == 5


@pytest.mark.slow
def test_unit_memory_of_a_process(outer):
    """Unit: forty times the turns take no more memory, but for what the allocator happens to hold."""
    prepare(outer, roller_bearing(outer))  # compiling takes memory too
    short, long = (peak_memory(outer, turns) for turns in (4, 160))
    assert 50.0 < short < 2000.0 and abs(long - short) < 5.0


@pytest.mark.slow
def test_script_scaling(tmp_path):
    """Script: sentences and files; memory over turns a hundred times as many."""
    program = [sys.executable, ROOT / "examples" / "benchmarks" / "scaling.py", "--out", tmp_path]
    shown = subprocess.run(program, capture_output=True, text=True, check=False)
    assert shown.returncode == 0, shown.stderr
    assert "4000 counted turns: at most " in shown.stdout
    record = json.loads((tmp_path / "scaling.json").read_text())
    assert [len(record[kind]) for kind in ("rollers", "slices", "memory")] == [6, 6, 2]
    few, many = (memory["peak_MiB"] for memory in record["memory"])
    assert abs(many - few) < 5.0
    assert {file.name for file in tmp_path.iterdir()} == {"scaling.json", "scaling.csv", "scaling.png"}
