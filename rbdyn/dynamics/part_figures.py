"""Figures of parts of a bearing: power terms, operating clearances, contact pressures and films, life, stiffness, with their errors.

Studies, limits, maps and uncertainties name them as they name the figures of the whole bearing. Each is declared once, in ``figures``.
Life, also over a duty, and stiffness follow from static loads by ISO/TS 16281; nothing is simulated for them.
"""

import math
from collections.abc import Mapping, Sequence
from contextlib import suppress
from dataclasses import replace
from functools import partial

import numpy as np

from rbdyn.base.arrays import Array
from rbdyn.base.faults import InputError, MethodError
from rbdyn.base.records import plain
from rbdyn.contact.hertz_line import iso_16281
from rbdyn.dynamics.figures import PARTS, of_kind
from rbdyn.dynamics.forces.state import INNER_LOAD, OUTER_LOAD
from rbdyn.dynamics.parameters.model import roller_relief
from rbdyn.dynamics.parameters.validity import race_notes, race_report
from rbdyn.dynamics.statistics.batch_means import student_factor
from rbdyn.dynamics.statistics.metrics import Runs
from rbdyn.life import ROLLER_EXPONENT, DutyLife, LoadCase, duty_life, turning_rings
from rbdyn.life.rollers import ReferenceLife, RollerContacts, Stiffness, reference_life, static_loads, static_stiffness
from rbdyn.properties.materials import equivalent_modulus
from rbdyn.result import Quantity, RollerContact
from rbdyn.scene import Scene
from rbdyn.scene.thermal import Temperatures, at_temperatures

GAPS, CONTACTS, (LIFE,) = of_kind("clearance"), of_kind("contact"), of_kind("life")
STIFFNESS = [figure.key for figure in of_kind("stiffness")]
EXACT = [*(figure.key for figure in (*GAPS, LIFE)), *STIFFNESS]


def races_of(scene: Scene, runs: Runs) -> dict[str, RollerContact]:
    """``race_report`` at the largest loads of all runs."""
    return race_report(scene, *(max(run.largest_load(race) for run in runs) for race in (INNER_LOAD, OUTER_LOAD)))


def part_figures(scene: Scene, runs: Runs, figures: Mapping[str, Quantity]) -> dict[str, Quantity]:
    """Every figure of parts that the scene has, by its key; ``figures``: those that follow from batches.

    A clearance is exact for its scene, and so are life and stiffness, of which there are none without a load. The error of a contact follows from the scatter of the replicates' largest loads.
    """
    exact = {name: Quantity(value, 0.0, 0.0, float(len(runs))) for name, value in _exact(scene).items()}
    races, *reports = (plain(races_of(scene, part)) for part in (runs, *([run] for run in runs)))
    contacts = {}
    for contact in CONTACTS:
        race, key = contact.source
        if key in races.get(race, {}):
            values = [report[race][key] for report in reports if key in report.get(race, {})]
            contacts[contact.key] = _extreme(races[race][key], values)
    found = {**figures, **exact, **contacts}
    return {figure.key: found[figure.key] for figure in PARTS if figure.key in found}


def at_temperatures_with_errors(
    scene: Scene, figures: Mapping[str, Quantity], temperatures: Mapping[str, Quantity]
) -> dict[str, Quantity]:
    """The figures of a scene with a heat balance, whose clearances, life and stiffness have the errors of its ``temperatures`` by node.

    These errors have one cause, the friction, so that their effects add; unknown where a temperature within them is impossible.
    """
    nodes = {node: figure.value for node, figure in temperatures.items()}
    at = {name: figure.value for name, figure in figures.items() if name in EXACT}
    errors = dict[str, dict[str, float | None]]()
    for kind in ("statistical_error", "numerical_error"):
        shifts = {node: getattr(figure, kind) for node, figure in temperatures.items()}
        errors[kind] = dict.fromkeys(at)
        if None in shifts.values():
            continue
        with suppress(InputError):
            moved = [
                _exact(at_temperatures(scene, Temperatures(**{**nodes, node: nodes[node] + shift})))
                for node, shift in shifts.items()
            ]
            errors[kind] = {
                name: math.fsum(abs(other[name] - value) for other in moved)
                if all(name in other for other in moved)
                else None
                for name, value in at.items()
            }
    freedom = min((node.degrees_of_freedom for node in temperatures.values() if node.degrees_of_freedom), default=None)
    return {
        name: replace(
            figure,
            statistical_error=errors["statistical_error"][name],
            numerical_error=errors["numerical_error"][name],
            degrees_of_freedom=freedom,
        )
        if name in at
        else figure
        for name, figure in figures.items()
    }


def _exact(scene: Scene) -> dict[str, float]:
    """Operating clearances [um] of a scene, its life [h] and stiffness [N/um], by the key of their figure."""
    gaps = scene.clearances
    figures = {figure.key: 1e6 * gap.operating for figure in GAPS if (gap := gaps[figure.source[0]]) is not None}
    hours = static_life(scene).hours(*scene.operation.speeds)
    return figures | ({LIFE.key: hours} if math.isfinite(hours) else {}) | _stiffness(scene)


def _stiffness(scene: Scene) -> dict[str, float]:
    """Stiffness along and across the load [N/um] and travel over a pitch [um]; empty without load, or where the scene leaves it out."""
    if not scene.numerics.stiffness:
        return {}
    try:
        found = row_stiffness(scene)
    except MethodError:
        return {}
    return dict(zip(STIFFNESS, (1e-6 * found.along, 1e-6 * found.across, 1e6 * max(found.travel)), strict=True))


def _extreme(value: float, values: list[float]) -> Quantity:
    """A figure at the largest load of all replicates: it scatters at most as one of their ``values`` does."""
    if len(values) < 2:
        return Quantity(value, None, None, float(len(values)))
    freedom = len(values) - 1
    half = float(np.std(values, ddof=1)) * student_factor(freedom)
    return Quantity(value, half, None, float(len(values)), freedom)


def static_life(scene: Scene) -> ReferenceLife:
    """Reference life of ISO/TS 16281 at the operating clearance, by its laminae and its own line contact.

    The load is the steady one in line with the rotating one, of a schedule the largest. Gravity, form errors and a flexible support
    are left out. Edge stresses count where the roller has a profile, as in ``motion.rating_life``.
    """
    inner, outer = _static_loads(scene)
    return rated_life(scene, inner, outer)


def _static_loads(scene: Scene) -> tuple[Array, Array]:
    """``static_loads`` of a scene."""
    drawing, geometry = scene.bearing, scene.geometry
    angle = 2.0 * np.pi * np.arange(drawing.rollers) / drawing.rollers
    return static_loads(
        static_contacts(scene, angle),
        drawing.rollers,
        scene.operation.largest_load_N,
        geometry.clearance,
        geometry.centrifugal_force,
    )


def static_overload(scene: Scene) -> str:
    """A sentence on a raceway that the static loads of ``static_life`` press beyond its shakedown limit; empty without."""
    races = race_report(scene, *(float(loads.sum(axis=2).max()) for loads in _static_loads(scene)))
    return next((note for note in race_notes(scene, races) if note.code == "overload"), "")


def rated_life(scene: Scene, inner: Array, outer: Array, angle: Array | None = None) -> ReferenceLife:
    """`reference_life` of the bearing of a scene under loads on its laminae, at its ratings and speeds."""
    drawing = scene.bearing
    return reference_life(
        inner,
        outer,
        capacity=drawing.rated_capacity,
        gamma=drawing.diameter_ratio,
        turning=turning_rings(*scene.operation.speeds),
        angle=angle,
        edges=drawing.roller_profile != "cylinder",
    )


def row_stiffness(scene: Scene, clearance: float | None = None) -> Stiffness:
    """Stiffness of the row, mean over a pitch, by the loads, contacts and omissions of ``static_life``.

    ``clearance``: diametral [m], by default the operating one. Raises MethodError where no roller carries load.
    """
    geometry = scene.geometry
    return static_stiffness(
        partial(static_contacts, scene),
        scene.bearing.rollers,
        scene.operation.largest_load_N,
        geometry.clearance if clearance is None else clearance,
        geometry.centrifugal_force,
        symmetric=scene.bearing.tilt == 0.0,
    )


def static_contacts(scene: Scene, angle: Array) -> RollerContacts:
    """Contacts of rollers at these azimuths (n,) from the load [rad]."""
    modulus = equivalent_modulus(scene.material("roller"), scene.material("rings"))
    line = iso_16281(modulus, scene.bearing.effective_length).stiffness
    return RollerContacts(line, (_relief(scene, "inner", angle), _relief(scene, "outer", angle)))


def _relief(scene: Scene, race: str, angle: Array) -> Array:
    """Profile drop less the rise by tilt at the slice centres [m], (1, slices), or (n, slices) with a tilt."""
    drawing, slices = scene.bearing, scene.slices
    drop = roller_relief(scene, slices)[None]
    if drawing.tilt == 0.0:
        return drop
    from rbdyn.contact.profile import slice_centres

    share = drawing.inner_tilt_share if race == "inner" else 1.0 - drawing.inner_tilt_share
    tilt = drawing.tilt * share * np.cos(angle - drawing.tilt_direction)
    return np.asarray(drop - tilt[:, None] * slice_centres(slices, drawing.effective_length))


def roller_duty_life(scenes: Sequence[Scene], shares: Sequence[float]) -> DutyLife:
    """Life over a duty from the scene at each point and its share of time; loads are the radial ones."""
    cases = [load_case(scene, share) for scene, share in zip(scenes, shares, strict=True)]
    return duty_life(cases, ROLLER_EXPONENT)


def load_case(scene: Scene, share: float) -> LoadCase:
    """The scene as a point of a duty with this share of the time."""
    inner, outer = scene.operation.speeds
    return LoadCase(share, inner - outer, scene.operation.largest_load_N, static_life(scene))
