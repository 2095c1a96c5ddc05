"""What an error allows to be said: the one place where the studies draw their conclusions.

A relative difference d is known to its 95 % half-width e; a is the accuracy sought. It is

- within, where e <= a and |d| <= a;
- beyond, where |d| > a and either e <= a, or |d| - e > a: a large difference is plain in spite of a large error;
- undecided otherwise: the error hides it.

Half-widths fall as one over the root of the counted turns; with replicates Student's factor falls too. From this law
follow the turns or the replicates that would decide.
"""

import math
from collections.abc import Iterable
from typing import Literal, NamedTuple

from rbdyn.dynamics.statistics.batch_means import student_factor
from rbdyn.faults import InputError
from rbdyn.scene import Scene

Verdict = Literal["within", "beyond", "undecided"]

# A per cent is less than two bearings of one lot differ by.
SOUGHT = 0.01
NORMAL = 1.96
# From so many replicates on Student's factor is that of the normal distribution to two digits.
MANY = 100


class Difference(NamedTuple):
    """A relative difference with its 95 % half-width; ``where`` names output and row."""

    where: str
    value: float
    error: float


def judged(value: float, error: float, sought: float = SOUGHT) -> Verdict:
    """What can be said of a difference that is known to ``error``; all relative. An error of NaN decides nothing."""
    size = abs(value)
    if size > sought and (error <= sought or size - error > sought):
        return "beyond"
    return "within" if error <= sought and size <= sought else "undecided"


def overall(verdicts: Iterable[Verdict]) -> Verdict:
    """That of several differences at once: one beyond settles it, one undecided leaves it open."""
    given = set(verdicts)
    return "beyond" if "beyond" in given else "undecided" if "undecided" in given else "within"


def check_replicates(scene: Scene) -> None:
    """Raises InputError for a single replicate, whose mean has no error here."""
    if scene.numerics.replicates < 2:
        what = "numerics.replicates = 1: the study compares means over replicates"
        raise InputError([f"{what}; give at least 2, better 8"])


def turns_needed(error: float, turns: float, sought: float = SOUGHT) -> float:
    """Counted turns of a replicate at which a half-width of ``error`` after ``turns`` would fall to ``sought``."""
    return turns * (error / sought) ** 2


def replicates_needed(error: float, replicates: int, sought: float = SOUGHT) -> int:
    """Replicates at which a half-width of ``error`` over ``replicates`` > 1 of them would fall to ``sought``."""
    scatter = error * math.sqrt(replicates) / student_factor(replicates - 1)
    needed = max(math.ceil((NORMAL * scatter / sought) ** 2), 2)
    while needed < MANY and student_factor(needed - 1) * scatter > sought * math.sqrt(needed):
        needed += 1
    return needed


def about(count: float) -> str:
    """A count in two digits, rounded up."""
    unit = 10.0 ** max(math.floor(math.log10(count)) - 1, 0) if count > 1.0 else 1.0
    return f"{math.ceil(count / unit - 1e-9) * unit:.0f}"


def percent(value: float) -> str:
    """A relative figure in two digits."""
    return f"{100.0 * value:.2g} %"


def undecided(hidden: Iterable[Difference], scene: Scene, sought: float = SOUGHT) -> str:
    """What hides what, and the turns or replicates that would tell; the least known of ``hidden`` speaks for all."""
    worst = max(hidden, key=lambda difference: difference.error)
    numerics = scene.numerics
    turns = turns_needed(worst.error, numerics.turns, sought)
    replicates = replicates_needed(worst.error, numerics.replicates, sought)
    hides = f"errors of {percent(worst.error)} hide differences of {percent(abs(worst.value))} ({worst.where})"
    mend = f"raise numerics.turns to about {about(turns)} or numerics.replicates to about {about(replicates)}"
    return f"undecided: {hides}; to tell {percent(sought)} {mend}"
