"""A published table of the same design beside ours."""

from string import ascii_uppercase

import numpy as np
from scipy.stats import spearmanr

from doe.response_surface import Surface
from doe.study.design import design_of
from doe.study.runs import Runs, read_runs
from doe.study.surfaces import fit_surfaces
from doe.study_file import Study
from rbdyn.faults import InputError
from rbdyn.records.record import Record, derived, keyed, outside_json


class Effect(Record):
    """Linear effect of a factor per coded unit, ours and theirs, and whether either is significant at 5 %."""

    ours: float
    theirs: float
    same_sign: bool = derived(lambda self: self.ours * self.theirs > 0.0)
    ours_significant: bool = outside_json()
    theirs_significant: bool = outside_json()


class Beside(Record):
    """One response next to a published table of the same design.

    Ranges are least, mean, largest value; ``effects`` go by factor. ``rank_correlation`` is Spearman's over the runs,
    ``verdict`` a sentence: level, signs of the effects that the published table shows, ranks.
    """

    response: str = outside_json()
    our_range: tuple[float, float, float] = keyed("ours_min_mean_max")
    their_range: tuple[float, float, float] = keyed("theirs_min_mean_max")
    effects: dict[str, Effect] = keyed("linear_effects")
    rank_correlation: float
    verdict: str = derived(lambda self: self._sentence())
    why: str

    def _sentence(self) -> str:
        shown = {factor: effect for factor, effect in self.effects.items() if effect.theirs_significant}
        opposite = [factor for factor, effect in shown.items() if not effect.same_sign]
        signs = f"sign differs for {', '.join(opposite)}" if opposite else "all with our sign"
        level = f"our mean is {self.our_range[1] / self.their_range[1]:.2f} of theirs"
        effects = f"of their {len(shown)} significant linear effects, {signs}"
        return f"{self.response}: {level}; {effects}; rank correlation {self.rank_correlation:+.2f}."


def reference_runs(study: Study) -> Runs | None:
    """The published table in the order of our design. Raises InputError when it is of another design."""
    if study.file.reference is None:
        return None
    path = study.beside(study.file.reference.file)
    table = read_runs(study, path)
    left = list(range(len(table.coded)))
    order = []
    for point in design_of(study).coded:
        distance = [float(np.abs(table.coded[row] - point).max()) for row in left]
        if not distance or min(distance) > 0.02:
            place = f"the design point {point.round(3).tolist()} (coded)"
            raise InputError([f"{path}: no run left for {place}; mend the reference"])
        order.append(left.pop(int(np.argmin(distance))))
    return Runs(table.coded[order], table.actual[order], table.values[order], table.errors[order])


def beside(study: Study, ours: Runs, theirs: Runs) -> list[Beside]:
    """Every response of both, with the linear effects on the surfaces through either."""
    assert study.file.reference is not None
    surfaces = zip(fit_surfaces(study, ours), fit_surfaces(study, theirs), strict=True)
    lettered = dict(zip(study.factors, ascii_uppercase, strict=False))
    rows = []
    for index, (name, pair) in enumerate(zip(study.responses, surfaces, strict=True)):
        our_values, their_values = ours.values[:, index], theirs.values[:, index]
        rows.append(
            Beside(
                response=name,
                our_range=(our_values.min(), our_values.mean(), our_values.max()),
                their_range=(their_values.min(), their_values.mean(), their_values.max()),
                effects={name: _effect(*pair, letter) for name, letter in lettered.items()},
                rank_correlation=float(spearmanr(our_values, their_values).statistic),
                why=study.file.reference.why.get(name, ""),
            )
        )
    return rows


def _effect(ours: Surface, theirs: Surface, letter: str) -> Effect:
    values = [each.by_term.get(letter, 0.0) for each in (ours, theirs)]
    p = [{row["source"]: row["p"] for row in each.anova}.get(letter) for each in (ours, theirs)]
    return Effect(values[0], values[1], *(each is not None and each < 0.05 for each in p))
