"""Clearances of a cage in operation: formulas typed here next to the tool's, limits, signs, refusals, what dynamics gets."""

import math
import tomllib
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest
from instant_runs import instant_result
from typer.testing import CliRunner

from rbdyn.base.faults import InputError, read_toml
from rbdyn.cli.app import app
from rbdyn.dynamics.forces.cage import OuterGuide
from rbdyn.dynamics.parameters.model import roller_bearing
from rbdyn.dynamics.simulate import clearance_report
from rbdyn.scene import Scene
from rbdyn.scene.uncertain import Uncertain
from rbdyn.scene.unknown import inputs_of, value_of, with_values

SCENE = Path(__file__).parents[2] / "examples" / "cylindrical_roller.toml"
RINGS = {"bore_mm": 27.0, "outside_diameter_mm": 60.0, "housing_diameter_mm": 80.0}
# Elastic modulus [GPa], density [kg/m^3] and expansion [1e-6/K] of cages, and those of the rings with Poisson's ratio.
CAGES = {"brass": (105.0, 8500.0, 20.0), "peek": (3.9, 1320.0, 47.0)}
POLYAMIDE = (5.0, 1300.0, 40.0)
E, NU, RHO, ALPHA = 206e9, 0.3, 7827.0, 12e-6
BEARINGS = ("NU204", "NU208", "NU210 MB", "NU215 MA", "NU220 MB", "NU308", "NU314 PHA", "NU320 MB", "NU1020", "NU2210 TVP2",
            "NU2315 ML", "NU205 P")  # fmt: skip


def catalogue(designation: str, *options: str) -> Scene:
    """The scene of ``rbdyn new``."""
    written = CliRunner().invoke(app, ["new", *designation.split(), *options])
    assert written.exit_code == 0, written.output
    return Scene.from_dict(tomllib.loads(written.stdout))


def chen(cage: str = "bronze", rise: float = 80.0, **changes: Any) -> Scene:
    """The bearing of Chen et al. at 24000 rpm, all of it warmer than its drawing by one rise."""
    warm = {"inner_ring_temperature_C": 20.0 + rise, "outer_ring_temperature_C": 20.0 + rise}
    keys = {key.replace("__", "."): value for key, value in changes.items()}
    return Scene.load(SCENE).changed({"mounting": {**RINGS, **warm}, "materials": {"cage": cage}, **keys})


def lame(pressure: float, bore: float, outside: float, radius: float, on_bore: bool) -> float:
    """Growth of a thick steel ring under a pressure on its bore, or on its outside."""
    wall = E * (outside**2 - bore**2)
    if on_bore:
        return pressure * bore**2 * ((1.0 - NU) * radius + (1.0 + NU) * outside**2 / radius) / wall
    return -pressure * outside**2 * ((1.0 - NU) * radius + (1.0 + NU) * bore**2 / radius) / wall


def spun(bore: float, outside: float, radius: float, speed: float) -> float:
    """Growth of a turning steel ring by its stresses: u = r/E (hoop - nu radial), of a rotating disk with a hole."""
    load = (3.0 + NU) / 8.0 * RHO * speed**2
    holed = (bore * outside / radius) ** 2
    radial = load * (bore**2 + outside**2 - holed - radius**2)
    hoop = load * (bore**2 + outside**2 + holed - (1.0 + 3.0 * NU) / (3.0 + NU) * radius**2)
    return radius / E * (hoop - NU * radial)


def by_hand(
    scene: Scene, cage: tuple[float, float, float], speed_rpm: float, rises: dict[str, float]
) -> dict[str, float]:
    """Changes of guide and pocket [m] from the numbers of a drawing: solid steel shaft, loose outer ring."""
    modulus, density, expansion = cage[0] * 1e9 * 0.65, cage[1], cage[2] * 1e-6
    pitch, roller = 1e-3 * scene.bearing.pitch_diameter_mm, 1e-3 * scene.bearing.roller_diameter_mm
    bore, race = 0.5e-3 * scene.mounting.bore_mm, 0.5 * (pitch - roller)
    inner = speed_rpm * math.pi / 30.0
    # Half the operating clearance moves the races out and in alike: the mean speed stays that of the pitch circle.
    orbit = inner * (race - 0.25e-3 * scene.mounted_clearance_mm) / pitch
    land = pitch + {"outer": 1, "inner": -1, "roller": 0}[scene.cage.guidance] * 2.0 / 3.0 * roller
    pocket = 1e-3 * scene.cage.pocket_clearance_mm
    changes = {"pocket": expansion * rises["cage"] * (roller + pocket) - ALPHA * rises["roller"] * roller}
    if scene.cage.guidance == "roller":
        return changes
    guide = 1e-3 * scene.cage.guide_clearance_mm
    if scene.cage.guidance == "outer":
        across = land - guide
        changes["guide_fit"] = 0.0
        changes["guide_temperature"] = ALPHA * rises["outer"] * land - expansion * rises["cage"] * across
        changes["guide_rotation"] = -density * orbit**2 * across**3 / (4.0 * modulus)
        return changes
    across = land + guide
    # Pressure at which bore and shaft, which spin and touch, meet again.
    overlap = 0.5e-6 * scene.mounting.inner_interference_um
    overlap += ALPHA * (scene.mounting.shaft_temperature_C - scene.mounting.inner_ring_temperature_C) * bore
    overlap += RHO * inner**2 * (1.0 - NU) * bore**3 / (4.0 * E) - spun(bore, race, bore, inner)
    pressure = overlap / (lame(1.0, bore, race, bore, True) + (1.0 - NU) * bore / E)
    changes["guide_fit"] = -2.0 * lame(max(pressure, 0.0), bore, race, 0.5 * land, True)
    changes["guide_temperature"] = expansion * rises["cage"] * across - ALPHA * rises["inner"] * land
    changes["guide_rotation"] = density * orbit**2 * across**3 / (4.0 * modulus) - 2.0 * spun(
        bore, race, 0.5 * land, inner
    )
    return changes


@pytest.mark.parametrize("designation", BEARINGS)
def test_oracle_catalogue_bearings(designation):
    """Oracle: guide and pocket of twelve catalogue bearings, factor by factor, to 1e-7 of the drawn clearance."""
    scene = catalogue(designation, "--shaft", "m5", "--housing", "H7", "--temperature", "85", "--speed", "5000")
    material = scene.materials.cage
    cage = CAGES[material] if isinstance(material, str) else POLYAMIDE
    ring = {"outer": 65.0, "inner": 72.5, "roller": 72.5}[scene.cage.guidance]
    rises = {"outer": 65.0, "inner": 72.5, "roller": 72.5, "cage": 0.5 * (72.5 + ring)}
    expected = by_hand(scene, cage, 5000.0, rises)
    found = scene.cage_clearances
    assert found.pocket.temperature == pytest.approx(expected["pocket"], rel=1e-9)
    assert (found.guide is None) == ("guide_fit" not in expected)
    if found.guide is not None:
        for part in ("fit", "temperature", "rotation"):
            assert getattr(found.guide, part) == pytest.approx(expected[f"guide_{part}"], rel=1e-7, abs=1e-15), part
        assert found.guide.operating == pytest.approx(found.guide.drawn + sum(found.guide[1:]), rel=1e-15)


@pytest.mark.parametrize("guidance", ["outer", "inner", "roller"])
def test_unit_nothing_changes_without_heat_and_rotation(guidance):
    """Limit: no heat, no rotation, no fit: what is drawn, and the pockets' circle stays."""
    still = {"mounting__rotation": False, "cage__guidance": guidance}
    scene = chen(rise=0.0, **still)
    for name, play in scene.clearances.items():
        assert play is None or play.operating == play.drawn, name
    assert scene.cage_clearances.shift == 0.0
    assert scene.pocket_clearance_m == scene.cage.pocket_clearance
    assert scene.guide_clearance_m == (None if guidance == "roller" else 0.075e-3)


@pytest.mark.parametrize("guidance", ["outer", "inner", "roller"])
def test_unit_a_bearing_of_one_material_scales_with_its_heat(guidance):
    """Limit: one temperature and one expansion: every clearance grows in proportion, and no circle leaves another."""
    steel = {"elastic_modulus_GPa": 206.0, "poisson_ratio": 0.3, "density_kg_m3": 7827.0}
    scene = chen(steel, 100.0, mounting__rotation=False, cage__guidance=guidance, bearing__radial_clearance_mm=0.0)
    for name in ("guide", "pocket"):
        play = scene.clearances[name]
        assert play is None or play.operating == pytest.approx((1.0 + 12e-6 * 100.0) * play.drawn, rel=1e-12), name
    assert scene.cage_clearances.shift == pytest.approx(0.0, abs=1e-18)
    lip = scene.cage_clearances.lip
    assert lip is None or lip.operating == pytest.approx((1.0 + 12e-6 * 100.0) * lip.drawn, rel=1e-12)


@pytest.mark.parametrize(
    ("guidance", "key", "value", "sign"),
    [
        ("outer", "mounting.cage_temperature_C", 110.0, -1), ("inner", "mounting.cage_temperature_C", 110.0, 1),
        ("outer", "mounting.outer_ring_temperature_C", 110.0, 1), ("inner", "mounting.inner_ring_temperature_C", 110.0, -1),
        ("outer", "operation.inner_speed_rpm", 30000.0, -1), ("inner", "operation.inner_speed_rpm", 30000.0, -1),
        ("inner", "mounting.inner_interference_um", 20.0, -1), ("outer", "mounting.inner_interference_um", 20.0, 0),
        ("outer", "mounting.outer_interference_um", 20.0, -1), ("outer", "cage.hoop_modulus_share", 0.5, -1),
        ("inner", "cage.hoop_modulus_share", 0.5, 1), ("inner", "materials.cage", "peek", 1),
    ],
)  # fmt: skip
def test_unit_signs(guidance, key, value, sign):
    """Unit: what closes an outer guide and opens an inner one; a bronze cage grows less by speed than the inner ring it rides on."""
    scene = chen(mounting__cage_temperature_C=100.0, cage__guidance=guidance)
    before = scene.clearances["guide"].operating
    after = scene.changed({key: value}).clearances["guide"].operating
    # By the radial clearance a fit of the other ring changes the cage's speed in the fourth digit.
    assert after == pytest.approx(before, abs=1e-8) if sign == 0 else math.copysign(1, after - before) == sign


def test_literature_bronze_and_peek_at_24000_rpm():
    """Closed form: 80 K and 24000 rpm take 23.6 and 2.4 um of Chen's 150 um from a bronze cage, 138 and 10 um from one of PEEK."""
    plain = {"cage__hoop_modulus_share": 1.0}
    guide = chen(**plain).clearances["guide"]
    assert 1e6 * guide.temperature == pytest.approx(-23.6, abs=0.1)
    assert 1e6 * guide.rotation == pytest.approx(-2.4, abs=0.05)
    peek = chen("peek", model__guide_land="off", **plain).cage_clearances.guide
    assert 1e6 * peek.temperature == pytest.approx(-138.0, abs=0.1)
    assert 1e6 * peek.rotation == pytest.approx(-10.1, abs=0.1)
    # What a hoop with pockets keeps of its modulus divides what rotation takes.
    assert chen().clearances["guide"].rotation == pytest.approx(guide.rotation / 0.65, rel=1e-9)


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"cage": "peek"}, ("cage.guide_clearance_mm = 0.15", "temperature -138.0 um", "leave -3.6 um", "land_film_floor_um = 3")),
        ({"cage": "peek", "cage__hoop_modulus_share": 1.0}, ("leave 1.9 um, not above twice model.land_film_floor",)),
        ({"cage": "peek", "model__guide_land": "dry"}, ("leave -3.6 um: the cage seizes",)),
        (
            {
                "mounting__roller_temperature_C": 190.0,
                "mounting__cage_temperature_C": 90.0,
                "cage__pocket_clearance_mm": 0.006,
            },
            ("cage.pocket_clearance_mm = 0.006", "rotation +0.0 um leave -1.0 um: the cage seizes"),
        ),
        (
            {
                "mounting__roller_temperature_C": 180.0,
                "mounting__cage_temperature_C": 100.0,
                "cage__pocket_clearance_mm": 0.0055,
                "model__pocket_film": True,
            },
            ("leave 1.2 um, not above twice model.pocket_film_floor_um = 0.8",),
        ),
        (
            {"cage": "peek", "cage__guidance": "roller", "cage__pocket_radial_clearance_mm": 0.08},
            ("cage.pocket_radial_clearance_mm = 0.08: the pocket circle grows", "relative to the roller circle"),
        ),
    ],
)  # fmt: skip
def test_unit_a_cage_that_seizes_is_refused(changes, words):
    """Unit: a clearance at or below the floor of its film, or at nothing without one, is one sentence with the figures."""
    with pytest.raises(InputError) as refused:
        chen(**changes)
    (fault,) = refused.value.faults
    assert all(word in fault for word in words), fault


def test_unit_kelvin_of_a_mounting_explain_a_seizure():
    """Unit: temperatures in kelvin seize a cage of PEEK; the sentence says what was probably meant."""
    with pytest.raises(InputError, match=r"if 373 K are meant, write 99\.85"):
        chen("peek", 353.0)


def test_unit_a_polymer_cage_opens_on_the_inner_ring():
    """Unit: the same cage of PEEK runs where the inner ring guides it."""
    guide = chen("peek", cage__guidance="inner").clearances["guide"]
    assert guide.temperature > 0.1e-3 and guide.operating > guide.drawn


def test_unit_the_cage_has_the_mean_temperature_of_rollers_and_guiding_ring():
    """Unit: the default by guidance, rollers at the mean of the rings unless given; a given temperature wins."""
    rings = {"mounting__inner_ring_temperature_C": 120.0, "mounting__outer_ring_temperature_C": 100.0}
    assert [chen(cage__guidance=each, **rings).cage_temperature_C for each in ("outer", "inner", "roller")] == [
        pytest.approx(105.0), pytest.approx(115.0), pytest.approx(110.0),
    ]  # fmt: skip
    hot = chen(mounting__roller_temperature_C=130.0, **rings)
    assert hot.cage_temperature_C == pytest.approx(115.0)
    assert chen(mounting__cage_temperature_C=90.0).cage_temperature_C == pytest.approx(90.0)
    assert Scene.load(SCENE).cage_temperature_C is None


def test_unit_dynamics_gets_the_clearances_in_operation():
    """Unit: guide, pocket and lips of the equations are the operating ones; without [mounting] those of the drawing."""
    for scene in (Scene.load(SCENE), chen(), chen(cage__guidance="roller", model__guide_land="off")):
        bearing, cage = roller_bearing(scene), scene.cage
        mounted = scene.cage_clearances
        pocket = bearing.pocket if mounted is None or mounted.lip is None else bearing.pocket.walls
        play = cage.pocket_clearance if mounted is None else mounted.pocket.operating
        assert pocket.half_clearance == 0.5 * play
        if isinstance(bearing.guide, OuterGuide):
            guide = cage.guide_clearance if mounted is None else mounted.guide.operating
            assert bearing.guide.film.clearance == 0.5 * guide == scene.guide_clearance_m
        else:
            outer, inner = scene.geometry.raceways
            assert bearing.pocket.half_clearance == 0.5 * mounted.lip.operating
            assert bearing.pocket.orbit_radius == pytest.approx(0.5 * (outer + inner) + mounted.shift, rel=1e-15)
            assert mounted.shift > 0.0


def test_unit_the_report_of_a_run_states_every_share():
    """Unit: flat radial keys as ever; radial, guide and pocket with drawn, fit, temperature, rotation, operating."""
    plain = clearance_report(Scene.load(SCENE))
    assert plain["drawn"] == plain["operating"] == 20.0
    assert plain["guide"] == pytest.approx(
        {"drawn": 150.0, "fit": 0.0, "temperature": 0.0, "rotation": 0.0, "operating": 150.0}
    )
    mounted = chen(mounting__inner_interference_um=8.0)
    report = clearance_report(mounted)
    assert {"inner_fit", "outer_fit", "temperature", "rotation", "operating"} < set(report)
    assert report["radial"]["fit"] == pytest.approx(report["inner_fit"] + report["outer_fit"])
    for name in ("radial", "guide", "pocket"):
        play = report[name]
        assert list(play) == ["drawn", "fit", "temperature", "rotation", "operating"]
        assert play["operating"] == pytest.approx(sum(play.values()) - play["operating"])
    assert report["radial"]["operating"] == pytest.approx(report["operating"])
    assert clearance_report(mounted.changed({"cage.guidance": "roller"}))["guide"] is None
    kept = replace(instant_result(mounted), clearance_um=report)
    assert type(kept).from_dict(kept.as_dict()).clearance_um == report == kept.as_dict()["clearance_um"]


def test_unit_ranges_of_the_cage_in_operation():
    """Unit: the cage's temperature ranges about its default, the hoop's share about its own; neither without [mounting]."""
    data = read_toml(SCENE)
    keys = {each.key for each in inputs_of(Scene.load(SCENE), data, Uncertain())}
    assert not keys & {"mounting.cage_temperature_C", "cage.hoop_modulus_share"}
    scene = chen()
    tables = scene._tables
    laws = {each.key: each.law for each in inputs_of(scene, tables, Uncertain())}
    warm, share = laws["mounting.cage_temperature_C"], laws["cage.hoop_modulus_share"]
    assert (warm.low, warm.high, share.low, share.high) == pytest.approx((90.0, 115.0, 0.5, 0.8))
    assert "mounting.inner_ring_temperature_C" not in laws
    asked = inputs_of(scene, tables, Uncertain(estimated=["mounting.inner_ring_temperature_C"]))
    (ring,) = (each.law for each in asked if each.key == "mounting.inner_ring_temperature_C")
    assert (ring.low, ring.high) == pytest.approx((97.5, 102.5))
    hot = Scene.from_dict(with_values(tables, "scene", laws, {"mounting.cage_temperature_C": 115.0}))
    assert value_of(hot, "mounting.cage_temperature_C") == 115.0
    assert hot.clearances["guide"].operating < scene.clearances["guide"].operating
