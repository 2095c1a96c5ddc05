"""The whole study from Python: ``study`` and its answer."""

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property, partial
from pathlib import Path
from typing import TYPE_CHECKING, ClassVar

from doe.library.answer import Answer, Rows, optional_path, part_given, path_given, registered
from doe.workflow.effort import Effort, Follow
from rbdyn.base.blocks import Block, Bullets, Paragraph, Section
from rbdyn.base.folder import output_folder
from rbdyn.base.words import Notice, counted, improvement, quantity

if TYPE_CHECKING:
    from doe.report.summary import Summary
    from doe.workflow.parts import Made
    from doe.workflow.tolerances import FactorTolerance

# Patterns of the names of all files of a study.
STUDY_FILES = (
    "report.html", "answer.txt", "summary.json", "tables.xlsx", "design_runs.csv", "anova.csv", "coefficients.csv",
    "runs.csv", "front.csv", "confirmation.csv", "part_dimensions.csv", "duty_points.csv", "unknown_inputs.csv", "decides.csv",
    "published_comparisons.csv", "surface_*.png", "pareto_front.png", "robust_front.png", "adaptive_search.png", "duty_gains.png",
    "cage_orbit.png", "pocket_forces.png",
)  # fmt: skip


@dataclass(frozen=True, repr=False, eq=False)
class StudyAnswer(Answer):
    """Chosen clearances with their gains, limits and parts.

    Tables: "gains" (one row per response: baseline and pick, simulated), "pick" (one row per factor), "runs", "front", "confirmation"
    (all simulated points), "parts" (dimensions [mm]), and "quality", "anova", "coefficients" of the fits. Over a duty also
    "duty" (one row per response at each of its points).

    ``finished_before``: whether the answer was read from the folder, because nothing had changed since.
    """

    finished_before: bool = False
    shows_unmet: ClassVar[bool] = True

    @property
    def closing(self) -> list[str]:
        """The time that it took unless it was finished before, and its files."""
        files = ", ".join(self.files)
        if self.finished_before:
            return [f"Finished before, nothing has changed since: {self.folder} holds {files}"]
        cost = self.record["cost"]
        spent = f"{cost['total_s']:.1f} s, of which design runs {cost['design_s']:.1f} s"
        return [spent, f"written to {self.folder}: {files}"]

    @property
    def unmet(self) -> list[str]:
        """What keeps the study from its demands, such as a missed limit or chain."""
        return [*self.record["obstacles"]["sentences"]]

    @cached_property
    def summary(self) -> "Summary":
        """The record with its parts as attributes."""
        from doe.report.summary import Summary

        return Summary.from_dict(self.record)

    def blocks(self) -> list[Block]:
        from doe.report.files import blocks

        return blocks(self.summary)

    def sections(self) -> list[Section]:
        from doe.report.page import sections

        return sections(self.summary)

    def rows(self) -> Mapping[str, Rows]:
        from doe.report.sections.chain import allocation_sheet
        from doe.report.sections.duty import duty_figures
        from doe.report.sections.fit import fit_rows

        searched = self.summary.adaptive
        fits = fit_rows([*self.summary.fit.responses.values()])
        return {
            "gains": self._gains(),
            "pick": self._factors(),
            "runs": [
                {
                    "run": run.run,
                    "kind": run.kind,
                    **run.factors,
                    **{name: measured.value for name, measured in run.responses.items()},
                    **{f"{name}_error": measured.error for name, measured in run.responses.items()},
                }
                for run in self.summary.design.points
            ],
            "front": [point.row for point in (searched or self.summary.front).front],
            "confirmation": [
                {"point": name, **point.factors, "response": response, **value.as_dict()}
                for name, point in self.summary.confirmation.items()
                for response, value in point.responses.items()
            ],
            "parts": allocation_sheet(self.summary.chains).records,
            **{name: fits[name] for name in ("quality", "anova", "coefficients")},
            **({"duty": duty_figures(self.summary).records} if self.summary.duty else {}),
        }

    def _gains(self) -> Rows:
        gains, points, rows = self.summary.gains, self.summary.confirmation, []
        for name, pick in points["pick"].responses.items():
            gain = gains.get(name)
            rows.append(
                {
                    "response": name,
                    "baseline": points["baseline"].responses[name].value,
                    "pick": pick.value,
                    "gain_percent": None if gain is None else gain.percent,
                    "gain_error_percent": None if gain is None else gain.error_percent,
                    "verdict": None if gain is None else gain.verdict,
                }
            )
        return rows

    def _factors(self) -> Rows:
        baseline = self.summary.confirmation["baseline"].factors
        widths: dict[str, FactorTolerance | Made] = {**(self.summary.tolerances or {}), **self.summary.made}
        return [
            {
                "factor": name,
                "baseline": baseline.get(name),
                "pick": value,
                "half_width": widths[name].half_width if name in widths else None,
            }
            for name, value in self.summary.pick.items()
        ]

    def brief(self) -> str:
        changes = [
            f"{quantity(name)[0]} {improvement(gain.percent, gain.error_percent, gain.goal)}"
            for name, gain in self.summary.gains.items()
        ]
        judged = self.summary.confirmation["pick"].every_limit
        limits = [f"{limit.bound_words} {limit.verdict}" for limit in judged]
        return ", ".join([*changes, *limits])


@dataclass(frozen=True, repr=False, eq=False, kw_only=True)
class PartAnswer(Answer):
    """Design runs of a part of a study, which a call without ``part`` takes over. Table: "failures"."""

    words: str = ""

    @property
    def unmet(self) -> list[str]:
        """How many runs failed."""
        runs, failed = self.record["runs"], len(self.record["failures"])
        return [f"{failed} of {counted(runs, 'run')} failed in {self.words}"] if failed else []

    def blocks(self) -> list[Block]:
        done = self.record["runs"] - len(self.record["failures"])
        gathers = "the same command without --part gathers all parts and answers"
        causes = [f"{failure['label']}: {failure['cause']}" for failure in self.record["failures"]]
        return [
            Paragraph(f"{self.words}: {done} of {counted(self.record['runs'], 'design run')} done; {gathers}"),
            Bullets(causes),
        ]

    @property
    def closing(self) -> list[str]:
        """Where its store is."""
        return [f"kept in {self.folder}"]

    def rows(self) -> Mapping[str, Rows]:
        return {"failures": self.record["failures"]}

    def brief(self) -> str:
        return f"{self.words}, {counted(self.record['runs'], 'design run')}"


def study(
    path: Path | str,
    out: Path | str | None = None,
    part: str | None = None,
    adaptive: bool = False,
    robust: bool = False,
    workers: int | None = None,
    scheduler: str | None = None,
    retry: bool = False,
    progress: Follow = None,
    notice: Notice = None,
    force: bool = False,
) -> StudyAnswer | PartAnswer:
    """The whole study of a bearing's clearances, as ``doe study``: design, runs, surfaces, front, pick, tolerances, parts.

    - ``path``: STUDY.toml; ``out``: folder of the report and the store of runs, by default STUDY_results in the current one.
      A finished answer and finished runs are found there, so an interrupted study goes on where it stopped
    - ``part``: "K/N" makes only every N-th design run from the K-th, in a store of its own in ``out``; a call without it takes
      all parts over
    - ``adaptive``: also search the front in few runs, chosen by emulators; the pick is then on it
    - ``robust``: judge the pick over the unknown inputs of the scene; the table robust of a study asks for it too
    - ``workers``: threads, all processors by default; ``scheduler``: address of a dask cluster; ``retry``: repeat failed runs
    - ``progress(stage, done, total)``: called as runs end; ``notice(sentence)``: called with the number of runs, with their time,
      and with what no run can change
    - ``force``: also write over files in ``out`` that no command of ``doe`` made

    A broken limit is in ``answer["status"]`` and ``answer["limits"]``. Raises InputError with all faults of the
    study, RunError where too many runs fail.
    """
    from doe.workflow.problem import Problem
    from doe.workflow.queue import gather, refuse_other_parts
    from doe.workflow.status import finished_record, inputs_digest

    path = path_given(path, "path")
    folder = optional_path(out, "out") or Path(f"{path.stem}_results")
    effort, share = Effort(workers, scheduler, retry, progress, notice), part_given(part)
    if share is not None:
        return _part(path, folder, share, effort, force)
    with output_folder(folder, "doe", STUDY_FILES, force=force) as output, registered(path, folder):
        loaded = Problem.load(path)
        digest = inputs_digest(loaded, adaptive, robust)
        if not retry and (record := finished_record(folder, digest)):
            return StudyAnswer(record, folder, tuple(record["files"]), finished_before=True)
        refuse_other_parts(folder, inputs_digest(loaded))
        output.claim(path)
        gather(folder)
        from doe.report.files import write
        from doe.workflow.whole import run_study, unmet_chains

        if notice is not None:
            for sentence in unmet_chains(loaded):
                notice(sentence)
        options = {"adaptive": adaptive, "robust": robust}
        with effort.agenda(folder, "doe study", options, digest) as agenda:
            outcome = run_study(loaded, folder, effort, **options, agenda=agenda)
            record = output.write(partial(write, outcome), last="summary.json")
            agenda.finish(record["files"])
    return StudyAnswer(record, folder, tuple(record["files"]))


def _part(path: Path, whole: Path, share: tuple[int, int], effort: Effort, force: bool) -> PartAnswer:
    """The design runs of a part. Raises as ``study``."""
    from doe.running.store import Failure
    from doe.workflow.problem import Problem
    from doe.workflow.queue import part_folder, refuse_other_parts, run_part
    from doe.workflow.status import inputs_digest

    folder = part_folder(whole, share)
    with output_folder(folder, "doe", (), force=force) as output, registered(path, folder):
        loaded = Problem.load(path)
        digest = inputs_digest(loaded)
        refuse_other_parts(whole, digest)
        output.claim(path)
        with effort.agenda(folder, "doe study", inputs=digest) as agenda:
            results = run_part(loaded, folder, effort, share, agenda)
            agenda.finish([])
    failures = [{"label": result.label, "cause": result.cause} for result in results if isinstance(result, Failure)]
    record = {"status": "failed" if failures else "ok", "part": list(share), "runs": len(results), "failures": failures}
    return PartAnswer(record, folder, (), words=f"part {share[0]} of {share[1]}")
