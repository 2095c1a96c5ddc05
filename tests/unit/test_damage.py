"""Figures of damage: sliding and impacts of the cage."""

from __future__ import annotations

import json
from functools import cache

import pytest
from conftest import ROOT

import rbdyn
from doe.clearance import responses_of
from rbdyn.dynamics.figures import DAMAGE
from rbdyn.result import SimulationResult
from rbdyn.scene import Scene

SHORT = ("numerics.turns=4", "numerics.discard_turns=2", "numerics.replicates=3", "numerics.extend=false")


@cache
def result(*overrides: str) -> SimulationResult:
    """A short run of the example."""
    scene = ROOT / "examples" / "cylindrical_roller.toml"
    return rbdyn.simulate(scene, overrides=(*SHORT, *overrides), notice=None)


def test_sliding_is_friction_power_over_its_coefficient():
    """The coefficient times all sliding is the power of friction, of pockets and of a land without a film."""
    run = result("model.guide_land='dry'", "model.land_friction=0.08")
    scene, powers = Scene.from_dict(run.scene), run.power_terms_W
    pockets = scene.model.pocket_friction * scene.bearing.rollers * run.damage["pocket_sliding_N_m_s"].value
    assert pockets == pytest.approx(powers["pocket_friction"], rel=1e-9)
    land = 0.08 * run.damage["land_sliding_N_m_s"].value
    assert land == pytest.approx(powers["land_friction"], rel=1e-9) and land > 0.0
    assert run.damage["pocket_impact_power_W"].value == pytest.approx(powers["pocket_damping"], rel=1e-9)


def test_smaller_pockets_are_hit_with_less_power():
    """From a pocket clearance of 0.30 to 0.25 mm the sliding remains within 5 %, and the impacts lose less."""
    wide, narrow = (result(f"cage.pocket_clearance_mm={clearance}").damage for clearance in (0.30, 0.25))
    key = "pocket_sliding_N_m_s"
    assert narrow[key].value == pytest.approx(wide[key].value, rel=0.05)
    assert narrow["pocket_impact_power_W"].value < wide["pocket_impact_power_W"].value


def test_damage_is_stated_wherever_figures_are():
    """The JSON has an object of it with errors, studies may name each figure, and a saved result keeps it."""
    run = result()
    assert list(run.damage) == [figure.key for figure in DAMAGE if figure.key in run.damage]
    record = json.loads(json.dumps(run.as_dict()))
    assert record["damage"]["pocket_impact_power_W"]["statistical_error"] > 0.0
    assert SimulationResult.from_dict(record).damage == run.damage
    assert set(run.damage) <= set(run.responses) & set(responses_of(heats=False))


@pytest.mark.parametrize(
    ("override", "missing"),
    [
        ("model.pocket_friction=0", "pocket_sliding_N_m_s"),
        ("model.land_friction=0", "land_sliding_N_m_s"),
        ("model.guide_land='off'", "land_sliding_N_m_s"),
        ("model.pocket_film=true", "pocket_impact_power_W"),
    ],
)
def test_a_figure_without_its_law_is_left_out(override, missing):
    """Without friction there is nothing to divide by, and a film takes up impacts that contact does not see."""
    scene = Scene.load(ROOT / "examples" / "cylindrical_roller.toml", [override])
    (figure,) = (figure for figure in DAMAGE if figure.key == missing)
    assert figure.scale_in(scene) is None
