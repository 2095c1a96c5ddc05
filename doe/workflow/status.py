"""The stages of a study, whose result it is, its record if it is finished, and the status of a command: counts of runs.

For a plain study it loads no numerical library but numpy.
"""

import json
import time
from collections.abc import Iterable, Mapping, Sequence
from contextlib import suppress
from dataclasses import replace
from datetime import UTC, datetime
from itertools import product
from pathlib import Path
from typing import Any, get_args

from doe import clearance
from doe.clearance import every_scene, points_of, work_of
from doe.duty import Run, scenes_of
from doe.running.runner import ANSWER, Agenda, Stage, agendas_of
from doe.running.store import STORE, CurrentRun, EndedRun, Failure, Point, RunResult, Store, folders_of, grouped
from doe.study_file.sections import Front
from doe.workflow.problem import Problem
from doe.workflow.region import region_in_store
from rbdyn.base.digests import source_digest
from rbdyn.base.faults import InputError, read_bytes, read_toml
from rbdyn.base.files import code_version, digest_of, intact, read_json, versions
from rbdyn.base.identity import Identity, identity_of
from rbdyn.base.records import Record, plain
from rbdyn.base.tables.sheet import TABLES, split_path
from rbdyn.scene import Scene

# Typical wall time [s] of surfaces, front, pictures and report.
STEPS_S = 12.0
BASELINE, DESIGN, FRONT, TOLERANCES = "baseline", "design runs", "front", "tolerances"


def study_stages(study: Problem, adaptive: bool = False, robust: bool = False) -> list[Stage]:
    """Stages of ``doe study`` with these options, to the end. Raises InputError for an impossible study.

    The most runs of a stage include the further points that a broken limit may need.
    """
    works = dict(design_works(study))
    most_runs = 2 * len(works) if study.further_replicates else None
    confirmation = study.confirmation_run(study.baseline)
    stages = [
        _stage_of(BASELINE, 1, confirmation, BASELINE, fewest=1),
        Stage(DESIGN, (DESIGN,), len(works), sum(works.values()), most=most_runs),
        Stage(FRONT),
    ]
    if adaptive:
        from doe.adaptive.search import FRESH

        (search,) = study.adaptive_scenes(study.baseline[None], [study.usual_replicates], 0)
        settings = study.file.adaptive
        runs = max(settings.budget - len(study.design.coded), 0)
        # The shortest search stops after one batch and its fresh runs.
        fewest = min(settings.batch + round(FRESH * settings.budget), runs)
        stages.append(_stage_of("adaptive front", runs, search, fewest=fewest))
    # The pick by each rule, the one without its tolerances, and those of the surfaces and of the search.
    rules = len(get_args(Front.model_fields["pick"].annotation))
    points = rules + (study.file.front.tolerance_aware != "none") + 2 * adaptive
    tries = study.file.confirmation.tries - 1 if study.is_limited else 0
    most = points + tries + (len(study.factors) if adaptive else 0)
    # Picks by several rules may be one point of the drawing.
    titles = "confirmation", "beyond the region"
    stages.append(_stage_of("confirmation", points, confirmation, *titles, fewest=1, most=most))
    if robust or study.asks_robust:
        from doe.workflow.robust import robust_stage

        stages.append(robust_stage(study))
    if study.file.tolerances is not None or study.file.chain:
        stages.append(Stage(TOLERANCES))
    return [*stages, Stage(ANSWER)]


def shorter_by(study: Problem, adaptive: bool, robust: bool) -> list[str]:
    """What makes a study smaller."""
    return [
        *([] if study.file.duty is None or not study.shares else ["the [[duty]] points"]),
        *(["adaptive.budget"] if adaptive else []),
        *(["robust.points"] if robust else []),
        "numerics.turns or numerics.replicates (scene.set)",
    ]


def _stage_of(name: str, runs: int, run: Run, *titles: str, fewest: int, most: int | None = None) -> Stage:
    """A stage of ``runs`` runs like this one, counted by their simulations: over a duty each has several."""
    scenes = scenes_of(run)
    points = points_of(scenes, [""] * len(scenes))
    works = {point.key: work_of(scene) for point, scene in zip(points, scenes, strict=True)}
    count, mean_work = len(works), sum(works.values()) / len(works)
    most = None if most is None else count * most
    return Stage.of(name, count * runs, mean_work, *titles, fewest=count * fewest, most=most)


def design_works(study: Problem) -> list[tuple[str, float]]:
    """Key and work of every design run. Raises InputError."""
    ordered = study.plan
    points = clearance.points_of(ordered.scenes, ordered.labels, ordered.factors)
    return [(point.key, work_of(scene)) for point, scene in zip(points, every_scene(ordered.scenes), strict=True)]


# Modules whose code decides the files of a study: simulation, judgement and report.
CODE = ("rbdyn.dynamics.simulate", "doe.workflow.whole", "doe.report.files")


def inputs_digest(study: Problem, adaptive: bool = False, robust: bool = False) -> str:
    """Digest of all that the files of a study depend on: the study, the files it names, the options and the code."""
    options = json.dumps([adaptive, robust, versions()], sort_keys=True)
    texts = study.path.name, study.file.model_dump_json(), options, source_digest(*CODE)
    return digest_of(b"".join([*(text.encode() for text in texts), *map(_content, named_files(study))]))


def named_files(study: Problem) -> list[Path]:
    """Files that the study names: scene, chains, published table, samples of unknown inputs."""
    names = [study.scene.file, *(chain.file for chain in study.file.chain)]
    names += [] if study.file.reference is None else [study.file.reference.file]
    return [study.path_of(name) for name in (*names, *_samples(study)) if name is not None]


def study_identity(command: str, study: Problem, data: Path | None = None) -> Identity:
    """Identity of a study or of a step of it; ``data``: table of runs made elsewhere. A study without a scene has no bearing."""
    scene: Mapping[str, Any] = {}
    if study.file.scene is not None:
        with suppress(InputError):
            loaded = Scene.from_dict(
                study.read(study.scene.file), str(study.path_of(study.scene.file)), study.scene.set
            )
            scene = loaded.model_dump(mode="json")
    named = [study.path, *named_files(study)] if study.file.scene is not None else [study.path]
    identity = identity_of(command, scene, [*named, *([] if data is None else [data])])
    return replace(identity, point=_duty_words(study)) if study.shares and scene else identity


def _duty_words(study: Problem) -> str:
    """'duty of idle 15 %, cruise 80 %, take-off 5 %': the points of operation of a study with their shares of the time."""
    points = (f"{point.name} {100.0 * study.shares[point.name]:.3g} %" for point in study.file.duty)
    return f"duty of {', '.join(points)}"


def scene_identity(command: str, path: Path, overrides: Iterable[str], data: Path | None = None) -> Identity:
    """Identity of a result on the scene of a file, with a table of measurements. Raises InputError."""
    scene = Scene.load(path, overrides).model_dump(mode="json")
    return identity_of(command, scene, [path, *([] if data is None else [data])])


def finished_record(folder: Path, digest: str) -> dict[str, Any] | None:
    """The record of a finished study with this digest of its inputs, if it is intact with all its files; else None."""
    try:
        record = read_json(folder / "summary.json")
        files = map(folder.joinpath, record["files"])
        complete = intact(record) and record["inputs"] == digest and all(map(Path.is_file, files))
        complete = complete and record["answer_sha256"] == digest_of((folder / "answer.txt").read_bytes())
    except (OSError, ValueError, KeyError, TypeError, AttributeError):
        return None
    return record if complete else None


def _samples(study: Problem) -> list[str]:
    """The posterior sample of unknown inputs that the study names, or else its scene."""
    if study.file.uncertain is not None and study.file.uncertain.sample is not None:
        return [study.file.uncertain.sample]
    with suppress(InputError):
        declared = study.read(study.scene.file).get("uncertain")
        if isinstance(declared, dict) and isinstance(name := declared.get("sample"), str):
            return [str(Path(study.scene.file).parent / name)]
    return []


def _content(path: Path) -> bytes:
    """Bytes of a file; empty for one that cannot be read, which the study refuses later."""
    try:
        return read_bytes(split_path(path)[0])
    except InputError:
        return b""


FORMAT = "doe.status/1"
# Default folders of the commands on a scene.
SCENE_FOLDERS = ("{}_uncertainty", "{}_calibration")


class Content(Record):
    """Contents of a store: results and failures of points, current runs, ended runs, and agendas.

    The newest agenda is the last; each comes with whether its process lives.
    """

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
        """The newest agenda of a live process, or else of any process."""
        return next(iter([*self.alive[::-1], *(agenda for agenda, _ in self.agendas[::-1])]), None)


def study_status(study: Problem, folder: Path) -> dict[str, Any]:
    """Record of ``doe status`` for a study. It only reads, even while the study runs. Raises InputError."""
    region = region_in_store(study, folder)
    ordered = region.plan
    content = Content.of(folder, points_of(ordered.scenes, ordered.labels, ordered.factors))
    agenda = content.agenda
    stated_options = agenda.options if agenda else {}
    options = {name: stated_options.get(name, False) for name in ("adaptive", "robust")}
    answered = bool(finished_record(folder, inputs_digest(study, **options))) if agenda else _has_answer(study, folder)
    if agenda is None or not agenda.stages or agenda.inputs != inputs_digest(study, **options):
        # The study as it is now has no agenda.
        agenda = Agenda("doe study", options, "", agenda.threads if agenda else 1, study_stages(region, **options))
    for stage in agenda.stages:
        if stage.name == DESIGN:
            # Whichever process ran them.
            stage.finished_runs = max(stage.finished_runs, len(content.outcomes))
    keys = {key for key, _ in design_works(region)}
    failures = [outcome for outcome in content.outcomes.values() if isinstance(outcome, Failure)]
    running = [run for run in content.running if run.key in keys]
    counts = {
        "total": len(keys),
        "done": len(content.outcomes) - len(failures),
        "failed": len(failures),
        "running": len(running),
        "missing": len(keys) - len(content.outcomes) - len(running),
    }
    other_states = [run.status for run in content.ended if run.key not in keys]
    other_counts = {
        "done": other_states.count("done"),
        "failed": other_states.count("failed"),
        "running": len(content.running) - len(running),
    }
    return _record(study.path, folder, content, agenda, answered, counts, other_counts, failures)


def scene_status(path: Path, folder: Path, is_table: bool = False) -> dict[str, Any]:
    """Record of ``doe status`` for ``doe uncertainty`` or ``doe calibrate`` of a scene, ``doe run`` of a table. Raises InputError.

    The rows of a table belong to scenes that it may not name, so a finished table counts as finished after a change too.
    """
    content = Content.of(folder, [])
    agenda = content.agenda or Agenda("", {}, "", 1, [])
    unchanged = content_digest(path) == agenda.inputs or is_table
    answered = unchanged and agenda.files is not None and all((folder / name).is_file() for name in agenda.files)
    past_stages, stages_ahead = agenda.stages[: agenda.place], agenda.stages[agenda.place :]
    total = sum(stage.finished_runs for stage in past_stages) + sum(stage.runs for stage in stages_ahead)
    finished_runs = sum(stage.finished_runs for stage in agenda.stages)
    failed = sum(run.status == "failed" for run in content.ended)
    running = len(content.running)
    counts = {
        "total": finished_runs if answered else total,
        "done": max(finished_runs - failed, 0),
        "failed": failed,
        "running": running,
        "missing": 0 if answered else max(total - finished_runs - running, 0),
    }
    return _record(path, folder, content, agenda, answered, counts, {"done": 0, "failed": 0, "running": 0}, [])


def status_of(path: Path, folder: Path | None) -> dict[str, Any]:
    """Record of ``doe status`` for a study, a scene or a table of scenes, in its own folder by default. Raises InputError."""
    file, _ = split_path(path)
    if file.suffix.lower() in TABLES:
        return scene_status(file, folder or folder_of(path, "{}_results"), is_table=True)
    if "bearing" in read_toml(path):
        return scene_status(path, folder or folder_of(path, *SCENE_FOLDERS))
    return study_status(Problem.load(path), folder or folder_of(path, "{}_results"))


def folder_of(path: Path, *usual: str) -> Path:
    """Folder in which a command works on a file, or else the ``usual`` one with a store.

    Raises InputError if there are several.
    """
    running = folders_of(path)
    if len(running) > 1:
        raise InputError(f"{path}: runs in {' and in '.join(map(str, running))}; name one of them by --out")
    folders = [Path(pattern.format(path.stem)) for pattern in usual]
    stores = running or [folder for folder in folders if (folder / STORE).exists()]
    if len(stores) > 1:
        raise InputError(f"{path}: has runs in {' and in '.join(map(str, stores))}; name one of them by --out")
    return stores[0] if stores else folders[0]


def content_digest(path: Path) -> str:
    """Digest of the content of a scene's file. Raises InputError."""
    return digest_of(read_bytes(path))


def runs_digest(path: Path, overrides: Sequence[str]) -> str:
    """Digest of what decides the runs of a scene's file: its content, its overrides, and the code. Raises InputError."""
    return digest_of("\n".join([content_digest(path), *overrides, code_version(clearance.SIMULATION)]))


def _has_answer(study: Problem, folder: Path) -> bool:
    """Whether the folder holds the answer to the study with some options."""
    combinations = product((False, True), repeat=2)
    return any(finished_record(folder, inputs_digest(study, adaptive, robust)) for adaptive, robust in combinations)


def _record(
    path: Path,
    folder: Path,
    content: Content,
    agenda: Agenda,
    answered: bool,
    counts: Mapping[str, int],
    other_counts: Mapping[str, int],
    failures: Sequence[Failure],
) -> dict[str, Any]:
    # A live process has nothing left to run once its answer is written.
    alive = any(live_agenda.files is None for live_agenda in content.alive) or bool(content.running and not answered)
    answered = answered and not alive
    stage, runs = agenda.stage, (0, 0) if answered else agenda.runs_left
    return {
        "format": FORMAT,
        "status": "running" if alive else "finished" if answered else "unfinished",
        "study": str(path),
        "store": str(folder / STORE),
        "command": " ".join([agenda.command, *(f"--{name}" for name, value in agenda.options.items() if value)]),
        "stage": None if answered or stage is None else stage.name,
        "stopped_by": "" if answered or alive else agenda.fault,
        "stages": [_stage(agenda, place, answered) for place in range(len(agenda.stages))],
        "points": dict(counts),
        "failures": plain(grouped(failures)),
        "running": [_running(run) for run in content.running],
        "other": dict(other_counts),
        "spent_s": sum(run.seconds or 0.0 for run in content.ended),
        "runs_left": list(runs),
    }


def _stage(agenda: Agenda, place: int, answered: bool) -> dict[str, Any]:
    """A stage in the record; ``state``: "done", "running" (also if the command ended there) or "to come"."""
    stage = agenda.stages[place]
    past = answered or place < agenda.place
    state = "done" if past else "to come" if agenda.stage is None or place > agenda.place else "running"
    count = stage.finished_runs if past else stage.past_runs
    most = count if past else count + stage.runs_left[1]
    return {"name": stage.name, "state": state, "done": count, "runs": stage.runs, "most": most}


def _running(run: CurrentRun) -> dict[str, Any]:
    return {
        **{key: getattr(run, key) for key in ("label", "run", "host", "pid")},
        "since": datetime.fromtimestamp(run.since, UTC).isoformat(timespec="seconds"),
        "for_s": max(0.0, time.time() - run.since),  # the clock may have gone back
    }
