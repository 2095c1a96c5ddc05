"""``rbdyn map --stiffness``: stiffness of a bearing over speed and load, in the columns that programs of rotors read.

Rollers: static loads of ISO/TS 16281, mean over a pitch. Balls: the equilibrium, without the film. Each point has its operating
clearance, with [thermal] that of its steady temperatures. Static loads give no damping; a loss factor eta adds c = eta k/omega.
"""

import math
from collections import Counter
from collections.abc import Callable, Iterable, Sequence
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from rbdyn.base.arrays import Array
from rbdyn.base.blocks import Block, Column, Paragraph, Sheet, Table, with_notes
from rbdyn.base.command import Console, Delivery
from rbdyn.base.faults import MOST_VALUES, RPM, InputError, MethodError, RunError
from rbdyn.base.files import versions, write_json
from rbdyn.base.identity import identity_of
from rbdyn.base.notes import Note, Notes
from rbdyn.base.records import OverPoints, Record, derived
from rbdyn.base.words import counted
from rbdyn.life.rollers import turned
from rbdyn.scene import BallScene, Scene, scene_of
from rbdyn.scene.duty import AXES

FORMAT = "rbdyn.stiffness/1"
# Programs of rotors interpolate over speed by cubic splines.
FEWEST_SPEEDS = 5
ENTRIES = ("xx", "xy", "yx", "yy")
# Entries of the matrix on the screen; a coupling is shown only where there is one.
SHOWN = {"xx": "k_xx", "yy": "k_yy", "xy": "k_xy"}


class StiffnessPoint(Record):
    """Stiffness at a speed and a load, by axes "xx", "xy", "yx" and "yy"; None where ``status`` shows why there is none.

    ``clearance_um``: diametral operating clearance, None of ball bearings; ``variable_compliance_um``: travel of the shaft's centre over
    a pitch of the rollers, the larger one along or across the load.
    """

    inner_speed_rpm: float
    radial_load_N: float  # noqa: N815
    status: str
    stiffness_N_um: dict[str, float] | None  # noqa: N815
    damping_N_s_mm: dict[str, float] | None  # noqa: N815
    clearance_um: float | None
    variable_compliance_um: float | None


def stiffness_sheet(points: Sequence[StiffnessPoint]) -> Sheet[StiffnessPoint]:
    """One row per point in SI, with the names of the arguments of ROSS's BearingElement."""

    def coefficients(letter: str, field: str, factor: float, unit: str, meaning: str) -> list[Column[StiffnessPoint]]:
        def column(axes: str) -> Column[StiffnessPoint]:
            def value(point: StiffnessPoint) -> float | None:
                matrix: dict[str, float] | None = getattr(point, field)
                return None if matrix is None else factor * matrix[axes]

            return Column(f"{letter}{axes}", at=value, unit=unit, meaning=meaning if axes == "xx" else "")

        return [column(axes) for axes in ENTRIES]

    columns = (
        Column[StiffnessPoint]("speed", at=lambda point: RPM * point.inner_speed_rpm, unit="rad/s", meaning="of the inner ring"),
        *coefficients("k", "stiffness_N_um", 1e6, "N/m", "force along the first axis by a displacement along the second one"),
        *coefficients("c", "damping_N_s_mm", 1e3, "N s/m", "0 without a loss factor"),
        Column[StiffnessPoint]("radial_load_N", meaning="operating point"),
        Column[StiffnessPoint]("clearance_um", meaning="diametral operating clearance; empty of ball bearings"),
        Column[StiffnessPoint]("variable_compliance_um", meaning="travel of the shaft's centre over a pitch of the rollers"),
        Column[StiffnessPoint]("status", meaning="ok, or why the point failed"),
    )  # fmt: skip
    content = "One row per speed and load of `rbdyn map --stiffness`, in SI for programs of rotors."
    return Sheet("", columns, points, file="stiffness.csv", content=content)


class StiffnessMap(OverPoints, Record):
    """Points in rows of rising load, speeds rising in each row; ``load_angle_deg``: direction of the load from x of the matrices."""

    format: str = derived(lambda self: FORMAT)
    status: str = derived(lambda self: self.count_failed())
    speeds_rpm: tuple[float, ...]
    loads_N: tuple[float, ...]  # noqa: N815
    load_angle_deg: float
    loss_factor: float
    points: tuple[StiffnessPoint, ...]
    versions: dict[str, str] = derived(lambda self: versions())
    notes: Notes = derived(lambda self: self._notes())

    def _notes(self) -> Notes:
        if self.loss_factor:
            damping = f"damping: c = {self.loss_factor:g} k/speed follows from the loss factor and the speed of the inner ring"
        else:
            damping = "damping: it is 0, because static loads give none. State --loss-factor or add it where the rotor is computed"
        return (Note("left-out", damping),)

    @property
    def sheet(self) -> Sheet[StiffnessPoint]:
        """A row a point, in SI."""
        return stiffness_sheet(self.points)

    def grid(self, axes: str) -> Array:
        """Values of an entry of the stiffness [N/um], shape (loads, speeds); NaN where a point failed."""
        values = [point.stiffness_N_um[axes] if point.stiffness_N_um else math.nan for point in self.points]
        return np.array(values).reshape(len(self.loads_N), len(self.speeds_rpm))


def stiffness_map(
    scene: Scene | BallScene | Path | str,
    speeds_rpm: Sequence[float],
    loads_N: Sequence[float],  # noqa: N803
    load_angle_deg: float = 0.0,
    loss_factor: float = 0.0,
    workers: int | None = None,
    progress: Callable[[int, int], None] | None = None,
    overrides: Iterable[str] = (),
) -> StiffnessMap:
    """Stiffness at every pair of inner speed and radial load; a scene with [thermal] has short runs for its temperatures at each.

    ``load_angle_deg``: direction of the load from x of the matrices. Raises InputError where a speed or load is impossible, with fewer
    than five speeds, and for a schedule.
    """
    scene = scene_of(scene, overrides)
    _check(scene, speeds_rpm, loads_N, loss_factor)
    texts = [
        (f"operation.inner_speed_rpm={speed!r}", f"operation.radial_load_N={load!r}")
        for load in map(float, loads_N)
        for speed in map(float, speeds_rpm)
    ]
    scenes = [scene.overridden(text) for text in texts]
    points = []
    for place, at_point in enumerate(scenes, 1):
        points.append(_point(at_point, math.radians(load_angle_deg), loss_factor, workers))
        if progress is not None:
            progress(place, len(scenes))
    return StiffnessMap(tuple(speeds_rpm), tuple(loads_N), load_angle_deg, loss_factor, tuple(points))


def _check(scene: Scene | BallScene, speeds: Sequence[float], loads: Sequence[float], loss_factor: float) -> None:
    if isinstance(scene, Scene) and scene.operation.schedule is not None:
        raise InputError("operation.schedule: a map sets speed and load itself; take the schedule away")
    if len(speeds) < FEWEST_SPEEDS:
        raise InputError(
            f"--speed: has {counted(len(speeds), 'value')}; a table for a rotor needs {FEWEST_SPEEDS}, such as 2000:12000:6"
        )
    if (count := len(speeds) * len(loads)) > MOST_VALUES:
        raise InputError(f"--speed, --load: {count} points are more than the {MOST_VALUES} kept at once; take fewer")
    if not 0.0 <= loss_factor < 1.0:
        raise InputError(f"--loss-factor {loss_factor:g}: must be at least 0 and below 1")
    if loss_factor > 0.0 and 0.0 in speeds:
        raise InputError(
            f"--loss-factor {loss_factor:g}: gives no damping at rest; begin --speed above 0, or leave it out"
        )


def _point(scene: Scene | BallScene, angle: float, loss_factor: float, workers: int | None) -> StiffnessPoint:
    """The stiffness of a scene in axes that see the load at ``angle`` [rad], or why there is none."""
    speed, load = scene.operation.inner_speed_rpm, scene.operation.radial_load_N or 0.0
    try:
        matrix, clearance, travel = _rollers(scene, workers) if isinstance(scene, Scene) else _balls(scene)
    except (InputError, RunError, MethodError) as error:
        return StiffnessPoint(speed, load, f"failed: {error}", None, None, None, None)
    matrix = turned(matrix, angle)
    # Of a bearing with mirror symmetry what couples both axes is rounding.
    matrix[np.abs(matrix) < 1e-9 * np.trace(matrix)] = 0.0
    damping = loss_factor / abs(RPM * speed) * matrix if loss_factor else np.zeros((2, 2))
    return StiffnessPoint(speed, load, "ok", _named(1e-6 * matrix), _named(1e-3 * damping), clearance, travel)


def _named(matrix: Array) -> dict[str, float]:
    return dict(zip(ENTRIES, matrix.ravel().tolist(), strict=True))


def _rollers(scene: Scene, workers: int | None) -> tuple[Array, float, float]:
    """Stiffness [N/m], operating clearance and travel [um] of rollers at steady temperatures. Raises MethodError where overloaded."""
    from rbdyn.dynamics.part_figures import row_stiffness, static_overload

    if scene.thermal is not None:
        from rbdyn.dynamics.simulate import steady_scene

        scene = steady_scene(scene, workers)
    if why := static_overload(scene):
        raise MethodError(why)
    found = row_stiffness(scene)
    return found.matrix, 1e6 * scene.geometry.clearance, 1e6 * max(found.travel)


def _balls(scene: BallScene) -> tuple[Array, Any, Any]:
    """Stiffness [N/m] of balls in equilibrium, with the axial place and the tilt of the ring fixed. Raises MethodError without one,
    and where no ball touches the inner raceway.
    """
    from rbdyn.quasistatic.bearing import equilibrium

    result = equilibrium(scene, ranges=False)
    matrix = np.array(result.reached.stiffness.matrix_SI)[:2, :2]
    for note in result.notes or ():
        if note.code == "loose-ring":
            raise MethodError(str(note))
    return matrix, None, None


def over_speed(
    console: Console,
    path: Path,
    scene: Scene | BallScene,
    axes: tuple[list[float], list[float]],
    load_angle_deg: float,
    loss_factor: float,
    workers: int | None,
) -> Delivery:
    """Stiffness of the scene of a file over speeds and loads."""
    console.folder.claim(path)
    with console.progress("mapping") as progress:
        found = stiffness_map(scene, *axes, load_angle_deg, loss_factor, workers, progress)
    swept = dict(zip(AXES, axes, strict=True))
    identity = identity_of("rbdyn map --stiffness", scene.model_dump(mode="json"), [path], swept=swept)
    return Delivery(identity, found.as_dict, partial(blocks, found), partial(write, found), bool(found.failed))


def blocks(found: StiffnessMap) -> list[Block]:
    """A table an entry of the matrix, points that failed, notes."""
    header = ("load [N]", *(f"{value:g} rpm" for value in found.speeds_rpm))
    tables: list[Block] = [
        Table(
            f"Stiffness {words} [N/µm]",
            header,
            [
                (f"{load:g}", *(f"{value:.4g}" if value == value else "failed" for value in row))
                for load, row in zip(found.loads_N, found.grid(axes), strict=True)
            ],
        )
        for axes, words in SHOWN.items()
        if axes != "xy" or any(point.stiffness_N_um and point.stiffness_N_um["xy"] for point in found.points)
    ]
    causes = Counter(point.status for point in found.failed)
    failed = [Paragraph(f"{counted(count, 'point')} {cause}") for cause, count in causes.items()]
    return with_notes(found.notes, [*tables, Paragraph(_axes_sentence(found)), *failed], judged=False)


def _axes_sentence(found: StiffnessMap) -> str:
    where = "along x" if not found.load_angle_deg else f"at {found.load_angle_deg:g} degrees from x"
    damping = f"follows a loss factor of {found.loss_factor:g}" if found.loss_factor else "is 0"
    return f"The load points {where}; damping {damping}. Files have N/m and rad/s for a program of rotors."


def write(found: StiffnessMap, folder: Path) -> None:
    """Write stiffness.json, stiffness.csv and stiffness.png."""
    from rbdyn.plots.roller import draw_stiffness

    write_json(folder / "stiffness.json", found.as_dict())
    found.sheet.save(folder)
    draw_stiffness(found.speeds_rpm, found.loads_N, found.grid("xx"), found.grid("yy"), folder / "stiffness.png")
