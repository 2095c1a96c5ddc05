"""The design: its points with their results, its quality, and failed runs."""

from collections.abc import Mapping, Sequence
from functools import partial
from typing import TYPE_CHECKING, Any, NamedTuple

from doe.designs.model import Evaluation, Shell
from doe.report.still import GUIDE, Point, Still
from doe.report.summary import Summary
from doe.running.store import Cause
from doe.workflow.design import DesignResult, DesignRun, StandardRun
from doe.workflow.problem import Asked
from doe.workflow.runs import StudyDesign, StudyRun
from rbdyn.base.blocks import Block, Column, Detail, Figures, Paragraph, Section, Sheet, Table, columns_of
from rbdyn.base.records import quoted_cell
from rbdyn.base.words import counted

if TYPE_CHECKING:
    from matplotlib.axes import Axes

# Rows above which a table is folded.
LONG = 40
RUN: Column[Any] = Column("run", meaning="number in standard order, from 1")
KIND: Column[Any] = Column("kind", meaning="part of the design: cube, axial, centre, ...", text=True)
BLOCK: Column[Any] = Column("block", meaning="block of the run")
CODED: Column[Any] = Column(
    "coded_{}", at=("coded", "{}"), unit="", screen=False,
    meaning="factor from -1 to 1 over the cube of the design; axial runs are outside",
)  # fmt: skip
FACTOR: Column[Any] = Column("{}", ".6g", at=("factors", "{}"), unit="of the name", meaning="values of the run")
RESPONSE: Column[Any] = Column("{}", at=("responses", "{}", "value"), unit="of the name", meaning="values of the run")
ERROR: Column[Any] = Column(
    "{}_error", at=("responses", "{}", "error"), unit="of the response", meaning="half width of its 95 % interval"
)


def run_sheet(factors: Sequence[str], responses: Sequence[str], runs: Sequence[StudyRun] = ()) -> Sheet[StudyRun]:
    """The runs of a study that ended."""
    columns = (RUN, KIND, BLOCK, *CODED.of(factors), *FACTOR.of(factors), *RESPONSE.of(responses), *ERROR.of(responses))
    ended = [run for run in runs if run.responses]
    return Sheet("Runs", columns, ended, file="design_runs.csv", content="One row per run of the design that ended.")


def design_sheet(factors: Sequence[str], runs: Sequence[StandardRun] = ()) -> Sheet[StandardRun]:
    """The runs of a design alone."""
    columns = (RUN, KIND, BLOCK, Column("standard"), Column("seed"), *CODED.of(factors), *FACTOR.of(factors))
    return Sheet("Runs", columns, runs, file="design.csv", content="One row per run of the design, in its order.")


def design(summary: Summary) -> Section:
    """Points table and evaluation."""
    result = summary.design
    kind = result.kind.replace("_", " ")
    title = Paragraph(f"{kind[0].upper()}{kind[1:]}, {result.runs} runs.")
    blocks = [title, _points(summary.asked, result), *_evaluation(result.evaluation), failure_table(result.failures)]
    return Section("design", "Design", blocks)


def _points(asked: Asked, result: StudyDesign) -> Table:
    runs = result.points
    columns: tuple[Column[StudyRun], ...] = (
        RUN,
        KIND,
        *([BLOCK] if len({run.block for run in runs}) > 1 else []),
        *(Column(factor.name, partial(factor.text, further=2), at=("factors", factor.name)) for factor in asked.factors),
        *Column[StudyRun](
            "{}", at=("responses", "{}", "value"), error=("responses", "{}", "error"), missing="failed"
        ).of(asked.names),
    )  # fmt: skip
    note = "± are 95 % half-widths of the mean of the replicates."
    return Sheet("Runs and responses", columns, runs, note, folded=len(runs) > LONG, sortable=True).block


class TermQuality(NamedTuple):
    """How well a design estimates a term: its variance inflation, and the power of tests for one and two sigma."""

    term: str
    vif: float
    one_sigma: float | None
    two_sigma: float | None


POWERS: tuple[Column[TermQuality], ...] = (
    Column("term"),
    Column("vif", ".3f", "VIF"),
    Column("power_one_sigma_percent", ".1f", "power for 1 sigma [%]", at="one_sigma"),
    Column("power_two_sigma_percent", ".1f", "power for 2 sigma [%]", at="two_sigma"),
)
BY_TERM: tuple[Column[TermQuality], ...] = (
    Column("term"), Column("vif", 3), Column("one_sigma_power_percent", 3, at="one_sigma"),
    Column("two_sigma_power_percent", 3, at="two_sigma"),
)  # fmt: skip


def power_sheet(evaluation: Evaluation, columns: tuple[Column[TermQuality], ...] = POWERS) -> Sheet[TermQuality]:
    """Variance inflation and power of every term."""
    powers = evaluation.power_percent
    rows = [TermQuality(term, vif, *vars(powers[term]).values()) for term, vif in evaluation.vif.items()]
    return Sheet("By term", columns, rows, detail=Detail.USUAL if columns is POWERS else Detail.LEAST)


def _evaluation(evaluation: Evaluation) -> list[Block]:
    """Single figures in one table; figures by term in another; the variances in pictures."""
    what = "Scaled prediction variance: least, mean and largest by radius"
    caption = f"{what}; and the value below which a share of the region is."
    pictures = Figures([still.svg for still in evaluation_plots(evaluation)], caption)
    return [quality_table(evaluation), power_sheet(evaluation, BY_TERM).block, pictures]


def failure_table(failures: Sequence[Cause]) -> Table:
    """Failures grouped by their cause."""
    return Sheet("What failed, by cause", columns_of(Cause), failures).block


def evaluation_plots(evaluation: Evaluation) -> list[Still]:
    """Variance dispersion graph and fraction of design space."""
    shells, shares = evaluation.by_radius, evaluation.fraction_of_design_space
    curves = {key: [(shell.radius, getattr(shell, key)) for shell in shells] for key in ("min", "mean", "max")}
    points = {"mean": [(share.percent, share.variance) for share in shares]}
    by_share = partial(_variance, "share of the region [%]", points)
    return [
        Still("Scaled prediction variance by radius: least, mean, largest", partial(_variance, "coded radius", curves)),
        Still("Scaled prediction variance by share of the region below it", by_share),
    ]


def _variance(across: str, curves: Mapping[str, Sequence[Point]], axis: "Axes") -> None:
    for key, curve in curves.items():
        axis.plot(*zip(*curve, strict=True), **({} if key == "mean" else GUIDE))
    axis.set(xlabel=across, ylabel="scaled prediction variance")
    axis.set_ylim(bottom=0.0)


def print_csv(result: DesignResult) -> None:
    """Run and actual factors, with the block where there are several."""
    print(",".join(["run", *(["block"] if result.is_blocked else []), *map(quoted_cell, result.factors)]))
    for run in result.runs:
        values = [f"{x:.9g}" for x in run.factors.values()]
        print(",".join([str(run.run), *([str(run.block)] if result.is_blocked else []), *values]))


def coded_sheet(factors: Sequence[str], runs: Sequence[DesignRun]) -> Sheet[DesignRun]:
    """The runs in coded values."""
    values = Column[DesignRun]("{}", "+.4f", at=("coded", "{}")).of(factors)
    columns = (RUN, Column[Any]("kind", words="point", text=True), *values)
    return Sheet("Coded values", columns, runs, detail=Detail.USUAL)


def design_blocks(result: DesignResult) -> list[Block]:
    """Runs in actual values, in coded ones, and the quality of the design; at full detail also seeds and leverages."""
    evaluation, runs = result.evaluation, result.runs
    drawn = tuple(zip(runs, evaluation.leverage, strict=True))
    order = *Column[Any]("{}", str, at=(0, "{}")).of(("run", "standard", "seed")), Column("leverage", ".3f", at=1)
    title = f"{result.kind.replace('_', ' ')}, {counted(len(runs), 'run')}"
    columns = (RUN, *([BLOCK] if result.is_blocked else []), *FACTOR.of(result.factors))
    return [
        Sheet(title, columns, runs).block,
        coded_sheet(result.factors, runs).block,
        Sheet("Order, seeds and leverages", order, drawn, detail=Detail.ALL).block,
        *_evaluation_tables(evaluation),
    ]


def _evaluation_tables(evaluation: Evaluation) -> list[Block]:
    """Quality of the design for the largest model of the study: as a whole, by term, by radius."""
    shells = Sheet("Scaled prediction variance by radius", columns_of(Shell), evaluation.by_radius, detail=Detail.ALL)
    return [quality_table(evaluation), power_sheet(evaluation).block, shells.block]


def quality_table(evaluation: Evaluation) -> Table:
    """Single figures of the quality of a design."""
    region = evaluation.region
    size = f"{'radius' if region.shape == 'ball' else 'half-width'} {region.reach:.4g}"
    model = f"{str(evaluation.model).replace('_', ' ')} model, {counted(len(evaluation.terms), 'term')}"
    title = f"{model}, over the {region.shape} of {size} (coded)"
    variance, blocks = evaluation.scaled_prediction_variance, evaluation.blocks
    freedom, letters = evaluation.degrees_of_freedom.items(), evaluation.efficiency_percent.items()
    scaled = f"centre {variance.centre:.2f}, mean {variance.mean:.2f}, max {variance.max:.2f}"
    rows = [
        ("efficiency [%]", ", ".join(f"{letter.upper()} {value:.1f}" for letter, value in letters)),
        ("scaled prediction variance", scaled),
        ("its maximum in the box of the front", f"{variance.box_max:.2f}"),
        ("degrees of freedom", ", ".join(f"{name.replace('_', ' ')} {n}" for name, n in freedom)),
        ("condition number of the model matrix", f"{evaluation.condition_number:.2f}"),
        ("largest leverage", f"{max(evaluation.leverage):.3f}"),
    ]
    if blocks is not None:
        relation = "orthogonal" if blocks.orthogonal else "not orthogonal"
        rows.append(("blocks", f"{relation} to the terms (largest cosine {blocks.largest_cosine:.3f})"))
    return Table(title, ("", "value"), rows, text_columns=(1,), detail=Detail.USUAL)
