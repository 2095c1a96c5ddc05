"""The report of a simulation: inputs, losses by size, life, clearances in operation, what to do next; digits that errors bear."""

from pathlib import Path

import pytest

from rbdyn.base.blocks import Detail, Table
from rbdyn.base.html import result_page
from rbdyn.base.identity import identity_of
from rbdyn.base.terminal import text
from rbdyn.base.words import shown
from rbdyn.cli.simulation_output import blocks
from rbdyn.dynamics.part_figures import static_life
from rbdyn.dynamics.simulate import simulate

QUICK = ("numerics.turns=4", "numerics.discard_turns=1", "numerics.replicates=2")


@pytest.fixture(scope="module")
def result(make_scene):
    return simulate(make_scene(*QUICK), notice=None)


def table(tree, caption):
    return next(block for block in tree if isinstance(block, Table) and block.caption.startswith(caption))


def test_losses_stand_by_size_with_their_sum(result):
    """Invariant: descending, and the terms make the whole within the digits shown; no loss of zero."""
    rows = table(blocks(result), "Power lost").rows
    names = [row[0] for row in rows]
    values = [float(row[1].partition(" ± ")[0]) for row in rows[: names.index("all") + 1]]
    assert values[:-1] == sorted(values[:-1], reverse=True) and min(values) > 0.0
    assert sum(values[:-1]) == pytest.approx(values[-1], rel=1e-2) and rows[names.index("all")][2] == "100 %"


def test_inputs_life_clearances_and_the_next_command_are_said(result, make_scene):
    """Literature: the life is that of ISO/TS 16281 by static loads, to two digits; the folder is the real one."""
    scene = make_scene(*QUICK)
    hours = static_life(scene).figures(*scene.operation.speeds).L10_h
    full = text(blocks(result, Path("run one")), Detail.ALL)
    assert f"life L10r: {shown(hours, 2)} h" in full and "next: rbdyn show run one --animate" in full
    profiled = make_scene(*QUICK, "bearing.roller_profile=logarithmic", "model.slices=31")
    with_edges = static_life(profiled).figures(*scene.operation.speeds).L10_h
    assert (
        with_edges < 0.7 * hours and f"; {shown(with_edges, 2)} h with the standard's profile and edge stress" in full
    )
    assert f"drawn +{1e3 * scene.bearing.radial_clearance_mm:.1f} µm" in full and "operating +" in full
    inputs = dict(table(blocks(result), "Inputs").rows)
    assert inputs["bearing: rollers"] == str(scene.bearing.rollers) and "bearing: pitch diameter [mm]" in inputs
    assert "next:" not in text(blocks(result), Detail.ALL)


def test_a_page_has_the_result_before_the_hashes(result, tmp_path):
    """The answer first; of the input files only the last section speaks."""
    (tmp_path / "scene.toml").write_text("x = 1", "utf-8")
    identity = identity_of("rbdyn simulate", result.scene, [tmp_path / "scene.toml"])
    page = result_page(identity, blocks(result), {})
    assert (
        page.index('id="result"') < page.index("power loss [W]") < page.index('id="identity"') < page.index("SHA-256")
    )


@pytest.mark.parametrize(
    ("value", "digits", "words"),
    [
        (3027392.3, 4, "3027000"), (3027392.3, 2, "3000000"), (72.8579, 4, "72.86"), (1234567.0, 7, "1234567"),
        (1e9, 3, "1e+09"),
    ],
)  # fmt: skip
def test_unit_a_number_has_no_more_digits_than_asked_for(value, digits, words):
    """Unit: also where it is written without an exponent."""
    assert shown(value, digits) == words
