"""What an adaptive search gives."""

from __future__ import annotations

from dataclasses import dataclass

from doe.adaptive.candidates import Region
from doe.adaptive.emulators import Emulators
from doe.adaptive.runs import Face
from doe.arrays import Array, Rows, Whole
from doe.pareto.simulated import Samples, SimulatedFront


@dataclass(frozen=True)
class Batch:
    """State of the search after ``runs`` runs that went well, those of the design included.

    ``hypervolume`` of the front foretold and its standard deviation over the functions drawn from the emulators; ``gained``
    by the last batch (NaN before the first); ``left`` to be gained if all were known. All on the scale of the front foretold
    at that time; ``reached`` is the hypervolume of that front by the last emulators, on the scale of the last front. ``why``
    the next batch was made: "improvement", or "check" of the front foretold; "" after the last.
    """

    runs: int
    hypervolume: float
    deviation: float
    gained: float
    left: float
    why: str
    reached: float = float("nan")


@dataclass(frozen=True, eq=False)
class AdaptiveFront:
    """A front found by emulators and confirmed by fresh runs.

    ``front``: its finalists in factor units with their fresh runs alone, and all runs of the search. ``archive`` (a, k) is the
    whole front that the emulators foretell, of which the rows ``shown`` have the largest hypervolume, with its ``foretold`` responses (a, m) and their ``deviations`` (a, m).
    ``region`` that was searched in the end. ``history``: state after every batch; ``fronts``: points (s, k), in coded units, that stand for the front foretold at each; ``searched`` (n,) are all runs of design and search, in factor units,
    ``why`` each was made ("design", "improvement", "check", "extension") and the replicates ``spent`` on it (n,); ``moves``: faces moved
    and where to (coded); ``faces`` that the pick lies at in the end.
    ``bias`` and ``spread`` (m,): mean, and root mean square about it, of what the fresh runs at the finalists missed the
    emulators by, in standard deviations. ``fresh``: number of the fresh runs. ``stopped``: why the search ended. ``seconds``
    of the emulators and of the choice of runs.
    """

    front: SimulatedFront
    archive: Array
    shown: Rows
    foretold: Array
    deviations: Array
    emulators: Emulators
    region: Region
    history: tuple[Batch, ...]
    fronts: tuple[Array, ...]
    moves: tuple[tuple[Face, float], ...]
    faces: tuple[Face, ...]
    searched: Samples
    why: tuple[str, ...]
    spent: Whole
    bias: Array
    spread: Array
    fresh: int
    stopped: str
    seconds: float
