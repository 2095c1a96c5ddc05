"""The stages of a study, whether it lies finished in its folder, and where a command stands: runs done, failed, under way or missing, and the
time left. Loads nothing heavy for a plain study.
"""

import json
import time
from collections.abc import Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from datetime import UTC, datetime
from itertools import product
from pathlib import Path
from typing import Any, get_args

from doe import clearance
from doe.clearance import points_of, work_of
from doe.running.lock import folders_of
from doe.running.runner import ANSWER, ANSWER_S, Agenda, Stage, agendas_of, forecast_of
from doe.running.store import CurrentRun, EndedRun, Failure, Point, RunResult, Store, grouped
from doe.study_file import Study
from doe.study_file.sections import Front
from doe.workflow.runs import STORE, ordered_runs
from rbdyn.base.faults import InputError, read_toml
from rbdyn.base.sources import source_digest
from rbdyn.base.storage import code_version, digest_of, intact
from rbdyn.result import read_json, versions

# Wall time [s] that surfaces with their front take about, and the pick's tolerances with the chains.
FRONT_S, TOLERANCES_S = 6.0, 1.0
# Wall time [s] of the emulators for a batch of an adaptive search.
BATCH_S = 0.6
DESIGN, FRONT, TOLERANCES = "design runs", "front", "tolerances"


def study_stages(study: Study, adaptive: bool = False, robust: bool = False) -> list[Stage]:
    """Stages of ``doe study`` with these options, to the end. Raises InputError where the study is impossible.

    Further points, where a limit is not kept, are among the most that a stage may run: nobody knows whether they are needed.
    """
    works = {
        key: work
        for at in (study.every_level if adaptive else [study.levels])
        for key, work in design_works(study.at(at))
    }
    stages = [Stage(DESIGN, (DESIGN,), len(works), sum(works.values())), Stage(FRONT, besides_s=FRONT_S)]
    if adaptive:
        from doe.adaptive.search import FRESH

        usual = clearance.design_scenes(study, study.baseline[None])[0].numerics.replicates
        (scene,) = clearance.adaptive_scenes(study, study.baseline[None], [usual], 0)
        settings, runs = study.file.adaptive, max(study.file.adaptive.budget - len(works), 0)
        # A search that gains nothing more stops after a batch and its fresh runs.
        fewest = min(settings.batch + round(FRESH * settings.budget), runs)
        stage = Stage.of("adaptive front", runs, work_of(scene), fewest=fewest)
        stages.append(replace(stage, besides_s=BATCH_S * runs / settings.batch))
    # The baseline, the pick by each rule, the one without its tolerances, and those of the surfaces and of the search.
    rules = len(get_args(Front.model_fields["pick"].annotation))
    points = 1 + rules + (study.file.front.tolerance_aware != "none") + 2 * adaptive
    one = work_of(clearance.confirmation_scene(study, study.baseline))
    limited = any(each.lower is not None or each.upper is not None for each in study.file.response)
    tries = study.file.confirmation.tries - 1 if limited else 0
    most = points + tries + (len(study.factors) if adaptive else 0)
    # Picks by several rules may be one point of the drawing.
    stages.append(Stage.of("confirmation", points, one, "confirmation", "beyond the region", fewest=2, most=most))
    if robust or clearance.declares_unknowns(study):
        from doe.workflow.stages_unknown import robust_stage

        stages.append(robust_stage(study))
    if study.file.tolerances is not None or study.file.chain:
        stages.append(Stage(TOLERANCES, besides_s=TOLERANCES_S))
    return [*stages, Stage(ANSWER, besides_s=ANSWER_S)]


def design_works(study: Study) -> list[tuple[str, float]]:
    """Key and work of every design run. Raises InputError."""
    ordered = ordered_runs(study)
    points = clearance.points_of(ordered.scenes, ordered.labels, ordered.factors)
    return [(point.key, work_of(scene)) for point, scene in zip(points, ordered.scenes, strict=True)]


# What simulates, what judges, and what shows it.
CODE = ("rbdyn.dynamics.simulate", "doe.workflow.whole", "doe.report.study.files")


def inputs_digest(study: Study, adaptive: bool = False, robust: bool = False) -> str:
    """Hash of all that the files of a study depend on: the study, the files it names, the code, what was asked."""
    named = [study.scene.file, *(chain.file for chain in study.file.chain)]
    named += [] if study.file.reference is None else [study.file.reference.file]
    named += [study.file.design.augment, *_samples(study)]
    asked = json.dumps([adaptive, robust, versions()], sort_keys=True)
    texts = study.path.name, study.file.model_dump_json(), asked, source_digest(*CODE)
    files = (_content(study.beside(name)) for name in named if name is not None)
    return digest_of(b"".join([*(text.encode() for text in texts), *files]))


def finished(folder: Path, digest: str) -> dict[str, Any] | None:
    """The record of a finished study of these inputs, as it was written, whose files are all there; else None."""
    try:
        record = read_json(folder / "summary.json")
        whole = (
            intact(record)
            and record["inputs"] == digest
            and all(map(Path.is_file, map(folder.joinpath, record["files"])))
        )
        whole = whole and record["answer_sha256"] == digest_of((folder / "answer.txt").read_bytes())
    except (OSError, ValueError, KeyError, TypeError, AttributeError):
        return None
    return record if whole else None


def _samples(study: Study) -> list[str]:
    """The posterior sample of unknown inputs that the study or, without such a table there, its scene names."""
    if study.file.uncertain is not None:
        return list(filter(None, [study.file.uncertain.sample]))
    with suppress(InputError):
        declared = read_toml(study.beside(study.scene.file)).get("uncertain")
        if isinstance(declared, dict) and isinstance(name := declared.get("sample"), str):
            return [str(Path(study.scene.file).parent / name)]
    return []


def _content(path: Path) -> bytes:
    """Bytes of a file; of one that cannot be read, which the study refuses later, none."""
    try:
        return path.read_bytes()
    except (OSError, ValueError):
        return b""


FORMAT = "doe.status/1"
# Folders of commands on a scene, where none is named.
SCENE_FOLDERS = ("{}_uncertainty", "{}_calibration")
# Time left [s] that is stated at least until all is finished; share of its time so far that an overdue part still takes.
LEAST_S, OVERDUE = 1.0, 0.3


@dataclass(frozen=True)
class Content:
    """What a store holds: results and failures of points, runs under way, ended runs, and agendas, the newest last, each with
    whether its process lives."""

    outcomes: Mapping[str, RunResult]
    running: Sequence[CurrentRun]
    ended: Sequence[EndedRun]
    agendas: Sequence[tuple[Agenda, bool]]

    @classmethod
    def of(cls, folder: Path, points: Sequence[Point]) -> "Content":
        """Read the store in a folder, if there is one. Raises InputError."""
        if not (folder / STORE).exists():
            return cls({}, [], [], [])
        with Store(folder / STORE, read_only=True) as store:
            outcomes, running = store.outcomes(points, clearance.sound), store.running()
            return cls(outcomes, [run for run in running if run.key not in outcomes], store.ended(), agendas_of(store))

    @property
    def alive(self) -> list[Agenda]:
        """Agendas of live processes."""
        return [agenda for agenda, alive in self.agendas if alive]

    @property
    def agenda(self) -> Agenda | None:
        """The newest agenda of a live process; of those that are gone, where none lives."""
        return next(iter([*self.alive[::-1], *(agenda for agenda, _ in self.agendas[::-1])]), None)


def study_status(study: Study, folder: Path) -> dict[str, Any]:
    """Record of ``doe status`` for a study. Changes nothing, not even while the study runs. Raises InputError."""
    ordered = ordered_runs(study)
    points = points_of(ordered.scenes, ordered.labels, ordered.factors)
    content = Content.of(folder, points)
    works, agenda = dict(design_works(study)), content.agenda
    given = agenda.options if agenda else {}
    options = {name: given.get(name, False) for name in ("adaptive", "robust")}
    answered = bool(finished(folder, inputs_digest(study, **options))) if agenda else _answered(study, folder)
    if agenda is None or not agenda.stages or agenda.inputs != inputs_digest(study, **options):
        # Nothing was planned for the study as it stands now.
        fresh = Agenda("doe study", options, "", agenda.threads if agenda else 1, study_stages(study, **options))
        agenda = replace(fresh, measured=agenda.measured, crowd=agenda.crowd) if agenda else fresh
    _count_design(agenda.stages, works, content.outcomes)
    if not agenda.measured.number:
        rows = [(works[run.key], run.seconds) for run in content.ended if run.seconds is not None and run.key in works]
        for work, seconds in rows:
            agenda.measured = agenda.measured.plus(work, seconds)
    keys = set(works)
    failures = [outcome for outcome in content.outcomes.values() if isinstance(outcome, Failure)]
    running = [run for run in content.running if run.key in keys]
    counts = {
        "total": len(keys),
        "done": len(content.outcomes) - len(failures),
        "failed": len(failures),
        "running": len(running),
        "missing": len(keys) - len(content.outcomes) - len(running),
    }
    others = [run.status for run in content.ended if run.key not in keys]
    other = {
        "done": others.count("done"),
        "failed": others.count("failed"),
        "running": len(content.running) - len(running),
    }
    return _record(study.path, folder, content, agenda, answered, counts, other, failures)


def scene_status(path: Path, folder: Path) -> dict[str, Any]:
    """The same for ``doe uncertainty`` and ``doe calibrate`` of a scene, whose runs count all alike. Raises InputError."""
    content = Content.of(folder, [])
    agenda = content.agenda or Agenda("", {}, "", 1, [])
    same = agenda.inputs == content_digest(path)
    answered = same and agenda.files is not None and all((folder / name).is_file() for name in agenda.files)
    past, ahead = agenda.stages[: agenda.place], agenda.stages[agenda.place :]
    total = sum(stage.done for stage in past) + sum(stage.runs for stage in ahead)
    ended = sum(stage.done for stage in agenda.stages)
    failed = sum(run.status == "failed" for run in content.ended)
    running = len(content.running)
    counts = {
        "total": ended if answered else total,
        "done": max(ended - failed, 0),
        "failed": failed,
        "running": running,
        "missing": 0 if answered else max(total - ended - running, 0),
    }
    return _record(path, folder, content, agenda, answered, counts, {"done": 0, "failed": 0, "running": 0}, [])


def status_of(path: Path, folder: Path | None) -> dict[str, Any]:
    """Record of ``doe status`` for a study or a scene, in its folder unless one is given. Raises InputError."""
    if "bearing" in read_toml(path):
        return scene_status(path, folder or folder_of(path, *SCENE_FOLDERS))
    study = Study.load(path)
    return study_status(study, folder or folder_of(path, "{}_results"))


def folder_of(path: Path, *usual: str) -> Path:
    """Folder in which a command works on a file, or the ``usual`` one that has a store while none does. Raises InputError where
    there are several."""
    running = folders_of(path)
    if len(running) > 1:
        raise InputError([f"{path}: runs in {' and in '.join(map(str, running))}; name one of them by --out"])
    named = [Path(each.format(path.stem)) for each in usual]
    stores = running or [folder for folder in named if (folder / STORE).exists()]
    if len(stores) > 1:
        raise InputError([f"{path}: has runs in {' and in '.join(map(str, stores))}; name one of them by --out"])
    return stores[0] if stores else named[0]


def content_digest(path: Path) -> str:
    """Digest of the content of a scene's file. Raises OSError."""
    return digest_of(path.read_bytes())


def runs_digest(path: Path, overrides: Sequence[str]) -> str:
    """Digest of what decides the runs of a scene's file: its content, keys that are replaced, and the code. Raises OSError."""
    return digest_of("\n".join([content_digest(path), *overrides, code_version(clearance.SIMULATION)]))


def _answered(study: Study, folder: Path) -> bool:
    """Whether the folder holds the answer to the study with any options."""
    asked = product((False, True), repeat=2)
    return any(finished(folder, inputs_digest(study, adaptive, robust)) for adaptive, robust in asked)


def _count_design(stages: Sequence[Stage], works: Mapping[str, float], outcomes: Mapping[str, RunResult]) -> None:
    """What the store has of the design counts, whichever process ran it."""
    for stage in stages:
        if stage.name == DESIGN:
            stage.done = max(stage.done, len(outcomes))
            stage.done_work = max(stage.done_work, sum(works[key] for key in outcomes))


def _record(
    path: Path,
    folder: Path,
    content: Content,
    agenda: Agenda,
    answered: bool,
    counts: Mapping[str, int],
    other: Mapping[str, int],
    failures: Sequence[Failure],
) -> dict[str, Any]:
    # A live process whose answer is written has nothing left to run.
    alive = any(each.files is None for each in content.alive) or bool(content.running and not answered)
    answered = answered and not alive
    stage, left_s = agenda.stage, 0.0 if answered else _left_s(agenda, content)
    forecast = None if answered else forecast_of(agenda, _threads(agenda, content), agenda.measured)
    low, high = (0.0, 0.0) if forecast is None else forecast.seconds
    runs = (0, 0) if answered else agenda.runs_left
    return {
        "format": FORMAT,
        "status": "running" if alive else "finished" if answered else "unfinished",
        "study": str(path),
        "store": str(folder / STORE),
        "command": " ".join([agenda.command, *(f"--{name}" for name, given in agenda.options.items() if given)]),
        "stage": None if answered or stage is None else stage.name,
        "stopped_by": "" if answered or alive else agenda.fault,
        "stages": [_stage(agenda, place, answered) for place in range(len(agenda.stages))],
        "points": dict(counts),
        "failures": grouped(failures),
        "running": [_running(run) for run in content.running],
        "other": dict(other),
        "spent_s": sum(run.seconds or 0.0 for run in content.ended),
        "left_s": left_s,
        "left_range_s": None if left_s is None else [min(left_s, low), max(left_s, high)],
        "runs_left": list(runs),
        "predicted_s": None if agenda.predicted is None else list(agenda.predicted),
        "took_s": agenda.took_s,
    }


def _stage(agenda: Agenda, place: int, answered: bool) -> dict[str, Any]:
    """A stage as ``doe status`` shows it; ``state``: done, running (or where a command that is gone ended) or to come."""
    stage = agenda.stages[place]
    past = answered or place < agenda.place
    state = "done" if past else "to come" if agenda.stage is None or place > agenda.place else "running"
    done = stage.done if past else max(stage.done, stage.stored)
    most = done if past else done + stage.left[1]
    return {"name": stage.name, "state": state, "done": done, "runs": stage.runs, "most": most}


def _running(run: CurrentRun) -> dict[str, Any]:
    return {
        **{key: getattr(run, key) for key in ("label", "run", "host", "pid")},
        "since": datetime.fromtimestamp(run.since, UTC).isoformat(timespec="seconds"),
        "for_s": _for_s(run, time.time()),
    }


def _for_s(run: CurrentRun, now: float) -> float:
    return max(0.0, now - run.since)


def _left_s(agenda: Agenda, content: Content) -> float | None:
    """Wall time [s] that the stages left take, with all that is known of what their runs take; None while nothing is.

    A live process goes on with as many runs at once as it has had in the stage, another with its threads.
    """
    whole = agenda.measured.pace
    if whole is None:
        return None
    now, left_s, threads = time.time(), 0.0, _threads(agenda, content)
    for place, (stage, work) in enumerate(agenda.left()):
        begun = stage.since is not None and place == 0
        measured = begun and stage.measured_work > 0.0
        pace = stage.seconds / stage.measured_work if measured else whole
        seconds, at_once = pace * max(work, 0.0), float(threads)
        if begun and content.alive and stage.since is not None:
            at_once = _at_once(stage.since, content, now) or at_once
            seconds -= sum(min(_for_s(run, now), pace * work / len(content.running)) for run in content.running)
            overdue_s = OVERDUE * (now - stage.since) if stage.besides_s else 0.0
            besides_s = max(stage.besides_s - (now - stage.since), overdue_s)
        else:
            besides_s = stage.besides_s
        left_s += max(seconds, 0.0) / at_once + besides_s
    return max(left_s, LEAST_S)


def _threads(agenda: Agenda, content: Content) -> int:
    """Threads of the live processes, of the last one where none lives."""
    return max(sum(each.threads for each in content.alive), 1) if content.alive else agenda.threads


def _at_once(since: float, content: Content, now: float) -> float | None:
    """Runs at once, in the mean since a moment; None while too few have ended to decide."""
    rows = [run for run in content.ended if run.seconds and run.started is not None and run.started >= since]
    begin = min((run.started for run in rows if run.started is not None), default=now)
    if len(rows) < 2 or now <= begin:
        return None
    busy = sum(run.seconds or 0.0 for run in rows) + sum(min(_for_s(run, now), now - begin) for run in content.running)
    return max(busy / (now - begin), 0.1)
