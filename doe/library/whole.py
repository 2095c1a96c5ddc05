"""The whole study from Python: ``study`` and its answer."""

from collections.abc import Mapping
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any

from doe.library.answer import Answer, Rows
from doe.library.effort import Effort, Follow, path_given, registered
from doe.library.steps import part_rows, point_row
from rbdyn.base.blocks import Block, Section
from rbdyn.base.folder import output_folder
from rbdyn.base.pace import Notice
from rbdyn.base.words import improvement, quantity

# Patterns of the names of all files of a study.
STUDY_FILES = (
    "report.html", "answer.txt", "summary.json", "tables.xlsx", "design_runs.csv", "anova.csv", "coefficients.csv",
    "runs.csv", "front.csv", "confirmation.csv", "part_dimensions.csv", "duty_points.csv", "unknown_inputs.csv", "decides.csv",
    "beside_reference.csv", "surface_*.png", "pareto_front.png", "robust_front.png", "adaptive_search.png", "duty_gains.png",
    "cage_orbit.png", "pocket_forces.png",
)  # fmt: skip


@dataclass(frozen=True, repr=False, eq=False)
class StudyAnswer(Answer):
    """Chosen clearances with their gains, limits and parts.

    Tables: "gains" (a row a response: baseline and pick, simulated), "pick" (a row a factor), "runs", "front", "confirmation"
    (all simulated points), "parts" (dimensions [mm]), and "quality", "anova", "coefficients" of the fits. Over a duty also
    "duty" (a row a response at each of its points).

    ``finished_before``: whether the answer was read from the folder, because nothing had changed since.
    """

    finished_before: bool = False

    def blocks(self) -> list[Block]:
        from doe.report.files import blocks

        return blocks(self.as_dict())

    def sections(self) -> list[Section]:
        from doe.report.page import sections

        return sections(self.as_dict())

    def rows(self) -> Mapping[str, Rows]:
        from doe.report.sections.duty import duty_rows
        from doe.report.sections.fit import fit_rows
        from doe.report.summary import restored
        from doe.response_surface.statistics import Fits

        record = self.record
        fits = fit_rows([*Fits.from_dict(record["fit"]).responses.values()])
        return {
            "gains": self._gains(),
            "pick": self._factors(),
            "runs": [
                {
                    "run": run["run"],
                    "kind": run["kind"],
                    **run["factors"],
                    **{name: value["value"] for name, value in run["responses"].items()},
                    **{f"{name}_error": value["error"] for name, value in run["responses"].items()},
                }
                for run in record["design"]["points"]
            ],
            "front": [point_row(point) for point in self._front()],
            "confirmation": [
                {"point": name, **point["factors"], "response": response, **value}
                for name, point in record["confirmation"].items()
                for response, value in point["responses"].items()
            ],
            "parts": part_rows(record["chains"]),
            **{name: fits[name] for name in ("quality", "anova", "coefficients")},
            **({"duty": duty_rows(restored(record))} if "duty" in record else {}),
        }

    def _front(self) -> list[dict[str, Any]]:
        """Points of the front: those of the adaptive search where there was one."""
        searched = self.record.get("adaptive")
        return self.record["front"]["front"] if searched is None else searched["front"]

    def _gains(self) -> Rows:
        confirmation, gains = self.record["confirmation"], self.record["gains"]
        rows = []
        for name, pick in confirmation["pick"]["responses"].items():
            baseline, gain = confirmation["baseline"]["responses"][name], gains.get(name, {})
            rows.append(
                {
                    "response": name,
                    "baseline": baseline["value"],
                    "pick": pick["value"],
                    "gain_percent": gain.get("percent"),
                    "gain_error_percent": gain.get("error_percent"),
                    "verdict": gain.get("verdict"),
                }
            )
        return rows

    def _factors(self) -> Rows:
        baseline, tolerances = self.record["confirmation"]["baseline"]["factors"], self.record.get("tolerances", {})
        tolerances = tolerances | self.record["made"]
        return [
            {
                "factor": name,
                "baseline": baseline.get(name),
                "pick": value,
                "half_width": (tolerances.get(name) or {}).get("half_width"),
            }
            for name, value in self.record["pick"].items()
        ]

    def brief(self) -> str:
        gains = self.record["gains"].items()
        changes = [
            f"{quantity(name)[0]} {improvement(gain['percent'], gain['error_percent'], gain['goal'])}"
            for name, gain in gains
        ]
        sentence = self.record["limits_sentence"]
        return ", ".join([*changes, *([sentence] if sentence else [])])


def study(
    path: Path | str,
    out: Path | str | None = None,
    adaptive: bool = False,
    robust: bool = False,
    workers: int | None = None,
    scheduler: str | None = None,
    retry: bool = False,
    progress: Follow = None,
    notice: Notice = None,
    force: bool = False,
) -> StudyAnswer:
    """The whole study of a bearing's clearances, as ``doe study``: design, runs, surfaces, front, pick, tolerances, parts.

    - ``path``: STUDY.toml; ``out``: folder of the report and the store of runs, by default STUDY_results in the current one.
      A finished answer and finished runs are found there, so an interrupted study goes on where it stopped
    - ``adaptive``: also search the front in few runs, chosen by emulators; the pick is then on it
    - ``robust``: judge the pick over the unknown inputs of the scene; the table robust of a study asks for it too
    - ``workers``: threads, all processors by default; ``scheduler``: address of a dask cluster; ``retry``: repeat failed runs
    - ``progress(stage, done, total)``: called as runs end; ``notice(sentence)``: called with the number of runs, with their time,
      and with what no run can change
    - ``force``: also write over files in ``out`` that no command of ``doe`` made

    A broken limit is in ``answer["status"]`` and ``answer["limits_sentence"]``. Raises InputError with all faults of the
    study, RunError where too many runs fail.
    """
    from doe.workflow.problem import Problem
    from doe.workflow.status import finished_record, inputs_digest

    path = path_given(path, "path")
    folder = Path(f"{path.stem}_results") if out is None else path_given(out, "out")
    effort = Effort(workers, scheduler, retry, progress, notice)
    with output_folder(folder, "doe", STUDY_FILES, force=force) as output, registered(path, folder):
        loaded = Problem.load(path)
        digest = inputs_digest(loaded, adaptive, robust)
        if not retry and (record := finished_record(folder, digest)):
            return StudyAnswer(record, folder, tuple(record["files"]), finished_before=True)
        output.claim(path)
        from doe.report.files import write
        from doe.workflow.whole import run_study, unmet_chains

        if notice is not None:
            for sentence in unmet_chains(loaded):
                notice(sentence)
        options = {"adaptive": adaptive, "robust": robust}
        with effort.agenda(folder, "doe study", options, digest) as agenda:
            bars = agenda.announced(effort.progress)
            outcome = run_study(loaded, folder, workers, bars, scheduler, retry, **options, agenda=agenda)
            record = output.write(partial(write, outcome), last="summary.json")
            agenda.finish(record["files"])
    return StudyAnswer(record, folder, tuple(record["files"]))
