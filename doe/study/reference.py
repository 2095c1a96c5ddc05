"""A published table of the same design beside ours."""

from dataclasses import dataclass

import numpy as np
from scipy.stats import spearmanr

from doe.response_surface import Surface
from doe.study.runs import Runs, design_points, read_runs
from doe.study.surfaces import fit_surfaces
from doe.study_file import Study
from rbdyn.faults import InputError


@dataclass(frozen=True)
class Beside:
    """One response next to a published table of the same design.

    ``effects``: factor name to the pair of linear effects per coded unit (ours, theirs), each with whether it is
    significant at 5 %. ``rank_correlation`` is Spearman's over the runs.
    """

    response: str
    our_range: tuple[float, float, float]
    their_range: tuple[float, float, float]
    effects: dict[str, tuple[tuple[float, bool], tuple[float, bool]]]
    rank_correlation: float
    why: str

    @property
    def verdict(self) -> str:
        """In a sentence: level, signs of the effects that the published table shows, ranks."""
        shown = {factor: pair for factor, pair in self.effects.items() if pair[1][1]}
        opposite = [factor for factor, (ours, theirs) in shown.items() if ours[0] * theirs[0] <= 0.0]
        signs = f"sign differs for {', '.join(opposite)}" if opposite else "all with our sign"
        return (
            f"{self.response}: our mean is {self.our_range[1] / self.their_range[1]:.2f} of theirs; of their "
            f"{len(shown)} significant linear effects, {signs}; rank correlation {self.rank_correlation:+.2f}."
        )


def reference_runs(study: Study) -> Runs | None:
    """The published table in the order of our design. Raises InputError when it is of another design."""
    if study.file.reference is None:
        return None
    path = study.beside(study.file.reference.file)
    table = read_runs(study, path)
    left = list(range(len(table.coded)))
    order = []
    for point in design_points(study):
        distance = [float(np.abs(table.coded[row] - point).max()) for row in left]
        if not distance or min(distance) > 0.02:
            raise InputError(
                [f"{path}: no run left for the design point {point.round(3).tolist()} (coded); mend the reference"]
            )
        order.append(left.pop(int(np.argmin(distance))))
    return Runs(table.coded[order], table.actual[order], table.values[order], table.errors[order])


def beside(study: Study, ours: Runs, theirs: Runs) -> list[Beside]:
    assert study.file.reference is not None
    pairs = zip(fit_surfaces(study, ours), fit_surfaces(study, theirs), strict=True)
    rows = []
    for index, (name, (our_surface, their_surface)) in enumerate(zip(study.responses, pairs, strict=True)):
        our_values, their_values = ours.values[:, index], theirs.values[:, index]
        our_effects, their_effects = (_linear_effects(study, each) for each in (our_surface, their_surface))
        rows.append(
            Beside(
                response=name,
                our_range=(our_values.min(), our_values.mean(), our_values.max()),
                their_range=(their_values.min(), their_values.mean(), their_values.max()),
                effects={factor: (our_effects[factor], their_effects[factor]) for factor in study.factors},
                rank_correlation=float(spearmanr(our_values, their_values).statistic),
                why=study.file.reference.why.get(name, ""),
            )
        )
    return rows


def _linear_effects(study: Study, surface: Surface) -> dict[str, tuple[float, bool]]:
    coefficients = dict(zip(surface.terms, surface.coefficients.tolist(), strict=True))
    significant = {row["source"]: row["p"] is not None and row["p"] < 0.05 for row in surface.anova}
    letters = "ABCDEFGH"[: len(study.factors)]
    return {
        factor: (coefficients.get(letter, 0.0), significant.get(letter, False))
        for factor, letter in zip(study.factors, letters, strict=True)
    }
