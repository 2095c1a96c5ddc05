"""Figures of a simulation, each once: what a result, a study, a limit, a map, a rig and the manual know of it.

They stand apart from compiled code so that a command can check a name without it.
"""

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Literal

import numpy as np

from rbdyn.base.arrays import Array
from rbdyn.dynamics.forces.places import POCKET_CONTACT_LOAD, POCKET_LOAD, SHAFT
from rbdyn.dynamics.statistics.replicate import Replicate, Statistic, largest, mean, timed, windowed
from rbdyn.losses import POWER_TERMS
from rbdyn.result import TEMPERATURES

if TYPE_CHECKING:
    from rbdyn.scene import Scene

SLOWEST_CAGE = 1e-6  # [rad/s]


@dataclass(frozen=True, eq=False)
class Figure:
    """A figure by the key of its JSON, which ends with its unit.

    - ``meaning``: in a sentence of the manual. ``kind``: of the whole "bearing", of a node ("temperature"), or of one of its parts
    - ``source``: of a part, the loss, clearance, or race and key of its report, that it is; of a temperature, its node
    - ``statistic``: how it follows from batches; None for what follows from the scene, the largest loads or the heat balance.
      ``scale``: factor of its unit, or that of a scene, None where the scene has no such figure
    - ``tested``: the statistic that shows whether a run has settled. ``slow``: whether slow change counts in its error.
      ``balanced``: whether the gap of the power balance does
    - ``words``: its row in the table of a run, where the key does not say it; ``window`` is that of impacts. ``repeats``: figure that
      it is left out beside where both are equal
    - ``judged``: whether notes say that its errors are large, and doe uncertainty has its range; ``aimed``: whether a target limits it
    - ``response``: whether a study may name it. ``harmonic``: whether its mean over time is that of its inverse
    - ``panel``: place on a map from 1, 0 for none; ``short``: its heading there and in tables of points; ``percent``: whether these
      show it in percent
    - ``worst``: which value is the worst one over a duty
    - ``measured``: what a rig measures, and ``accuracy`` of the sensor [%] where none is stated; empty where no rig does
    """

    key: str
    meaning: str
    kind: Literal["bearing", "temperature", "power", "clearance", "life", "contact"] = "bearing"
    source: tuple[str, ...] = ()
    statistic: Statistic | None = None
    scale: "float | Callable[[Scene], float | None]" = 1.0
    tested: Statistic | None = None
    slow: bool = True
    balanced: bool = False
    words: str = ""
    repeats: str = ""
    judged: bool = False
    aimed: bool = False
    response: bool = True
    harmonic: bool = False
    panel: int = 0
    short: str = ""
    percent: bool = False
    worst: Literal["largest", "least", "farthest from 0", "none"] = "largest"
    measured: str = ""
    accuracy: float = 0.0

    def scale_in(self, scene: "Scene") -> float | None:
        """Factor of the statistic in a scene; None where the scene has no such figure."""
        return self.scale(scene) if callable(self.scale) else self.scale


def deviation_ratio(sums: Array) -> Array:
    """Standard deviation over mean (Ghaisas et al. 2004); 0 for a cage at rest."""
    samples, total, squares = np.moveaxis(sums, -1, 0)
    defined = (samples > 1.5) & (total > 0.0)
    samples, total = np.where(defined, samples, 2.0), np.where(defined, total, 1.0)
    mean = total / samples
    variance = np.maximum(squares / samples - mean**2, 0.0) * samples / (samples - 1.0)
    return np.where(defined, np.sqrt(variance) / mean, 0.0)


def slip(sums: Array) -> Array:
    """1 - angle of the cage over its kinematic angle; 0 where counter-rotation leaves no kinematic speed."""
    duration, rolling, turned = np.moveaxis(sums, -1, 0)
    defined = np.abs(rolling) > SLOWEST_CAGE * duration
    return np.where(defined, 1.0 - turned / np.where(defined, rolling, 1.0), 0.0)


def orbit(run: Replicate) -> Array:
    """Samples of the cage's centre in each batch, and the sum of their squared distances from its mean place in the run."""
    samples, x, y, squares = run.orbit[run.first :].T
    mean_x, mean_y = (place.sum() / max(samples.sum(), 1.0) for place in (x, y))
    about = squares - 2.0 * (mean_x * x + mean_y * y) + samples * (mean_x**2 + mean_y**2)
    return np.column_stack((samples, np.maximum(about, 0.0)))


IMPACT_FORCE = windowed(POCKET_LOAD)
WHIRL_DEVIATION_RATIO = Statistic(lambda run: run.whirl[run.first :], deviation_ratio)
POWER_LOSS = timed(lambda run: run.work[:, :SHAFT].sum(axis=1))
CAGE_SPEED = timed(lambda run: run.cage_angle)
CAGE_SLIP = timed(lambda run: np.column_stack((run.kinematic_angle, run.cage_angle)), slip)
# Root mean square distance of the cage's centre from its mean place in a replicate [m].
ORBIT_RADIUS = Statistic(orbit, lambda sums: np.sqrt(sums[..., 1] / np.maximum(sums[..., 0], 1.0)))
# Shows a change of regime first.
WHIRL_SPEED = Statistic(lambda run: run.whirl[run.first :, :2], mean)


def _share_of_play(scene: "Scene") -> float | None:
    return None if scene.cage_play_m is None else 1.0 / scene.cage_play_m


BEARING = (
    Figure(
        "impact_force_N",
        "largest force of a roller on a pocket wall, contact and film together, mean over impact windows",
        statistic=IMPACT_FORCE,
        tested=largest(POCKET_LOAD),
        words="largest roller/cage force in {window} [N]",
        judged=True,
        aimed=True,
        panel=3,
        short="impact [N]",
        measured="largest force between a roller and the cage, mean over windows of shaft turns",
        # A force sensor with its mounting.
        accuracy=10.0,
    ),
    Figure(
        "impact_contact_force_N",
        "the same of the contact alone, without the oil film of the pocket",
        statistic=windowed(POCKET_CONTACT_LOAD),
        tested=largest(POCKET_CONTACT_LOAD),
        words="largest of it by contact alone, without the film [N]",
        repeats="impact_force_N",
        response=False,
        measured="impact force by contact alone, without the oil film of the pocket",
        accuracy=10.0,
    ),
    Figure(
        "whirl_deviation_ratio",
        "standard deviation over mean of the speed of the cage's centre",
        statistic=WHIRL_DEVIATION_RATIO,
        tested=WHIRL_DEVIATION_RATIO,
        judged=True,
        aimed=True,
        panel=4,
        short="whirl",
        measured="whirl deviation ratio of the cage's centre",
        # Eddy-current probes (API 670).
        accuracy=5.0,
    ),
    Figure(
        "power_loss_W",
        "mean power turned into heat",
        statistic=POWER_LOSS,
        tested=POWER_LOSS,
        balanced=True,
        judged=True,
        aimed=True,
        panel=2,
        short="loss [W]",
        measured="power loss of the bearing",
        # A torque sensor.
        accuracy=3.0,
    ),
    Figure(
        "cage_speed_rpm",
        "mean speed of the cage",
        statistic=CAGE_SPEED,
        scale=30.0 / math.pi,
        tested=CAGE_SPEED,
        judged=True,
        worst="none",
        measured="mean speed of the cage",
        # Pulses of a wheel.
        accuracy=0.1,
    ),
    # A slip near zero has no useful relative error; the cage speed shows it.
    Figure(
        "cage_slip",
        "1 less the speed of the cage over that of rolling without slip",
        statistic=CAGE_SLIP,
        panel=1,
        short="slip [%]",
        percent=True,
        worst="farthest from 0",
    ),
    Figure(
        "cage_orbit_radius_share",
        "root mean square distance of the cage's centre from its mean place, over the cage's radial play",
        statistic=ORBIT_RADIUS,
        scale=_share_of_play,
        slow=False,
        words="radius of the cage's orbit over its radial play",
        response=False,
    ),
)
_HEAT = tuple(
    # A thermocouple of class 1 at 100 C (IEC 60584-1: 1.5 K).
    Figure(key, f"steady temperature: {node}", "temperature", (node,), measured=measured, accuracy=1.5)
    for (key, node), measured in zip(
        TEMPERATURES.items(),
        (
            "temperature of the oil that leaves the bearing",
            "temperature of the outer ring",
            "temperature of the inner ring",
            "temperature of the rollers",
        ),
        strict=True,
    )
)
_CONTACTS: dict[str, tuple[str, Literal["largest", "least"]]] = {
    "max_pressure_MPa": ("largest pressure", "largest"),
    "central_film_um": ("film in the middle", "least"),
    "minimum_film_um": ("thinnest film", "least"),
    "lambda_ratio": ("film over roughness", "least"),
}
PARTS = (
    *(
        Figure(
            f"{loss}_power_W",
            f"mean power lost by {loss.replace('_', ' ')}",
            "power",
            (loss,),
            statistic=timed(lambda run, place=place: run.work[:, place]),  # type: ignore[misc]
        )
        for place, loss in enumerate(POWER_TERMS)
    ),
    *(
        Figure(
            f"{name}_operating_clearance_um",
            f"{name} clearance in operation, diametral",
            "clearance",
            (name,),
            worst="least",
        )
        for name in ("radial", "guide", "pocket")
    ),
    Figure(
        "life_h",
        "reference life L10r by the static loads at the operating clearance (ISO/TS 16281)",
        "life",
        # 1/L is damage an hour (Palmgren and Miner).
        harmonic=True,
        worst="least",
    ),
    *(
        Figure(f"{race}_{key}", f"{words} of the {race} race at its largest load", "contact", (race, key), worst=worst)
        for race in ("inner", "outer")
        for key, (words, worst) in _CONTACTS.items()
    ),
)
FIGURES = (*BEARING, *_HEAT, *PARTS)
# In the order of their places on a map.
PANELS = sorted((figure for figure in FIGURES if figure.panel), key=lambda figure: figure.panel)


def of_kind(kind: str) -> list[Figure]:
    """Figures of a kind."""
    return [figure for figure in FIGURES if figure.kind == kind]


def repeated(*tables: Mapping[str, object]) -> set[str]:
    """Keys of figures that only repeat another one in all of the tables by key."""
    return {
        figure.key
        for figure in BEARING
        if figure.repeats and all(table.get(figure.key) == table.get(figure.repeats) for table in tables)
    }
