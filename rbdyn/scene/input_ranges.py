"""Ranges of steady temperatures over the unknown inputs of a heat balance: conductances, shares of the heat, level of the loss.

Each set of these inputs is one balance: of the model about the steady state (``losses``), or, where a full solution takes no
simulation, of that, with the model's answer as its first guess. Their laws are the documented ones
(rbdyn/scene/unknown_inputs.toml). A key that the scene states is exact unless [uncertain] names it as estimated, as for ``doe
uncertainty``, which also varies all other inputs, by simulation.
"""

import math
from collections.abc import Callable, Collection, Iterator, Mapping, Sequence
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from rbdyn.base.arrays import Array
from rbdyn.base.faults import given
from rbdyn.clearances import DIFFERENCE
from rbdyn.result import Ranges
from rbdyn.thermal.losses import HOTTEST, TERMS, HeatModel
from rbdyn.thermal.network import INNER, NODES, OUTER

if TYPE_CHECKING:
    from rbdyn.scene import Scene
    from rbdyn.scene.ball import SingleRowScene
    from rbdyn.scene.thermal import Thermal
    from rbdyn.thermal.start import Law, Surroundings, Warming

# Keys of [thermal] that scale conductances, and the conductances that each scales; all keys that vary.
SCALED = {
    "surface_factor": ("oil_outer", "oil_inner", "oil_rollers"),
    "housing_factor": ("outer_ambient",),
    "shaft_factor": ("inner_ambient",),
    "sump_factor": ("sump",),
    "contact_factor": ("outer_rollers", "inner_rollers"),
    "oil_share": ("flow",),
}
OTHER = ("film_share_to_oil", "shaft_lag", "cage_offset_K")
# Keys of [thermal.start] that vary.
STARTING = ("housing_widths", "shaft_widths")
# Input sets, a power of two, their seed, and the quantiles that a range states.
SETS, SEED, QUANTILES = 256, 1, (0.05, 0.5, 0.95)


# By key of a scene, the losses (terms,) at a value of it over those at its own.
Levels = Mapping[str, Callable[[float], Array]]
# Of a set of inputs: keys of [thermal], ratios of conductances by name, and losses (terms,) over the usual ones.
Varied = tuple["Thermal", dict[str, float], Array]
# Clearances in operation (n,) [um] by name, at temperatures of the nodes (n, 4) [C], each with keys of [thermal]. Raises ValueError.
Clearances = Callable[[Array, Sequence["Thermal"]], Mapping[str, Array]]
# Shares of the nodes in the losses (terms, 4) by the share of a film's heat that its oil takes.
Shares = Callable[[float], Array]
# Steady temperatures (4,) [C] with keys of [thermal] by a full solution from a first guess (4,) [C], None where there are none.
Full = Callable[["Thermal", Array], Array | None]


def input_ranges(
    scene: "Scene | SingleRowScene",
    model: HeatModel,
    shares: Shares,
    clearances: Clearances,
    levels: Levels,
    estimated: Collection[str] = (),
    full: Full | None = None,
) -> Ranges:
    """Ranges about a steady state: of the nodes [C], of the inner ring over the outer one [K], and of clearances [um].

    ``estimated``: keys of the scene whose stated values are estimates. Without ``full`` the model's answers count. Sets whose temperatures run away, or beyond what any oil
    bears, count as without a steady state and as the hottest; their clearances are left out.
    """
    sets = input_sets(scene, levels, estimated)
    varied = list(varied_inputs(given(scene.thermal), sets, levels))
    dry, wet = shares(0.0), shares(1.0)
    to_oil = np.array([changed.film_share_to_oil for changed, *_ in varied])[:, np.newaxis, np.newaxis]
    ratios = {name: np.array([each[name] for _, each, _ in varied]) for name in varied[0][1]}
    models = model.varied(ratios, np.array([level for *_, level in varied]), dry + to_oil * (wet - dry))
    table = models.balanced()
    steady = models.is_stable(table)
    if full is not None:
        guesses = np.where(steady[:, np.newaxis], table, model.losses.temperatures)
        found = [full(changed, guess) for (changed, *_), guess in zip(varied, guesses, strict=True)]
        steady = np.array([nodes is not None for nodes in found])
        table = np.array([guess if nodes is None else nodes for nodes, guess in zip(found, guesses, strict=True)])
    table[~steady] = HOTTEST
    columns = dict(zip(NODES, table.T, strict=True))
    if steady.any():
        nodes, keys = table[steady], [varied[place][0] for place in np.flatnonzero(steady)]
        columns |= {DIFFERENCE: nodes[:, INNER] - nodes[:, OUTER], **clearances(nodes, keys)}
    figures = {name: tuple(np.quantile(column, QUANTILES).tolist()) for name, column in columns.items()}
    return Ranges(figures, tuple(sets), float(np.mean(table.max(axis=1) >= HOTTEST)))


def course_ranges(rows: "Warming", figures: Mapping[str, Array]) -> dict[str, tuple[float, ...]]:
    """Ranges of least figures (rows, machines) and of their times, of the largest lead of the inner ring, and of the time to the last
    temperatures.

    A time that one in twenty of the machines does not have has none.
    """
    from rbdyn.thermal.start import STEADY, leasts_of, settled_times

    found = {}
    for name, column in figures.items():
        if name == DIFFERENCE:
            found[name] = column.max(axis=0)
            continue
        found[name] = column.min(axis=0)
        *_, inside = leasts_of(rows.times, column)
        found[f"{name}_time_s"] = np.where(inside, rows.times[column.argmin(axis=0)], np.nan)
    found["time_to_steady_s"] = settled_times(rows.times, rows.temperatures, STEADY)
    return {
        name: tuple(np.nanquantile(column, QUANTILES).tolist())
        for name, column in found.items()
        if np.mean(np.isnan(column)) < QUANTILES[0]
    }


class StartRanges(NamedTuple):
    """Ranges of the figures of a start, bands of columns over time (two rows each), the inputs, and shares of the sets, named as in
    ``StartResult``."""

    ranges: dict[str, tuple[float, ...]]
    bands: dict[str, Array]
    inputs: tuple[str, ...]
    share_of_seizure: float
    share_with_minimum: dict[str, float] = {}


def bands_of(rows: "Warming", figures: Mapping[str, Array], count: int) -> dict[str, Array]:
    """5 and 95 % of the temperatures of many machines, and of their ``figures`` (rows, machines), in the first rows."""
    from rbdyn.thermal.start import WARMING_NODES

    nodes = dict(zip(WARMING_NODES, np.moveaxis(rows.temperatures, -1, 0), strict=True))
    ends = [QUANTILES[0], QUANTILES[-1]]
    return {name: np.quantile(column, ends, axis=1)[:, :count] for name, column in {**nodes, **figures}.items()}


def law_of_sets(law: "Law", around: Sequence["Surroundings"], varied: Sequence[Varied], shares: Shares) -> "Law":
    """The law of many machines, one for each set of inputs; ``around``: of each moment of the law."""
    from rbdyn.thermal.start import padded

    dry, wet = padded(shares(0.0)), padded(shares(1.0))
    networks = [[each.network(ratios) for each in around] for _, ratios, _ in varied]
    return law._replace(
        powers=law.powers * np.array([level for *_, level in varied])[:, np.newaxis, :],
        shares=np.array([dry + thermal.film_share_to_oil * (wet - dry) for thermal, *_ in varied]),
        matrices=np.array([[matrix for matrix, _ in row] for row in networks]),
        sources=np.array([[inflow for _, inflow in row] for row in networks]),
    )


def varied_inputs(thermal: "Thermal", sets: Mapping[str, Array], levels: Levels) -> Iterator[Varied]:
    """What changes with each set of inputs."""
    start = thermal.start
    for place in range(SETS if sets else 1):
        values = {key: float(column[place]) for key, column in sets.items()}
        row = {key.removeprefix("thermal."): value for key, value in values.items() if key not in levels}
        widths = {key: row.pop(f"start.{key}") for key in STARTING if f"start.{key}" in row}
        update = row if start is None else row | {"start": start.model_copy(update=widths)}
        ratios = {
            name: row[key] / getattr(thermal, key) for key, names in SCALED.items() if key in row for name in names
        }
        level = np.ones(len(TERMS))
        for key in sorted(set(levels) & set(values)):
            level *= levels[key](values[key])
        yield thermal.model_copy(update=update), ratios, level


def together(thermals: "Sequence[Thermal]") -> "Thermal":
    """[thermal] of many machines: the keys by which parts follow the nodes are arrays (n,), all others are from the first."""
    keys = ("shaft_lag", "cage_offset_K")
    return thermals[0].model_copy(update={key: np.array([getattr(each, key) for each in thermals]) for key in keys})


def input_sets(
    scene: "Scene | SingleRowScene",
    levels: Collection[str],
    estimated: Collection[str] = (),
    starting: Collection[str] = (),
) -> dict[str, Array]:
    """Values of each unknown input of the balance, (SETS,), by its key; ``levels``: keys that change losses.

    ``starting``: keys of [thermal.start] that vary too.
    """
    from scipy.stats import qmc

    from rbdyn.scene.uncertain import documented
    from rbdyn.scene.unknown import plain_values

    thermal, present = given(scene.thermal), plain_values(scene)
    stated = {f"{table}.{key}" for table in ("lubricant", "model") for key in scene._tables.get(table, {})}
    stated |= {f"thermal.{key}" for key in thermal.model_fields_set}
    stated |= {f"thermal.start.{key}" for key in ([] if thermal.start is None else thermal.start.model_fields_set)}
    # A conductance of zero stays so.
    keys = {
        *levels,
        *(f"thermal.{key}" for key in OTHER),
        *(f"thermal.start.{key}" for key in starting),
        *(f"thermal.{key}" for key in SCALED if getattr(thermal, key)),
    }
    laws = {
        entry.key: entry
        for entry in documented()
        if entry.key in keys
        and (entry.key in estimated or (entry.key not in stated and not entry.on_request))
        and entry.counts(present)
    }
    if not laws:
        return {}
    sample = qmc.Sobol(len(laws), seed=SEED).random_base2(int(math.log2(SETS)))
    sets = {}
    for (key, entry), share in zip(sorted(laws.items()), sample.T, strict=True):
        low, high = float(entry.low or 0.0), float(entry.high or 0.0)
        sets[key] = low * (high / low) ** share if entry.law == "log_uniform" else low + (high - low) * share
    return sets
