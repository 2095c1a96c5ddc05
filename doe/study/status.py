"""Where a study stands, from its store: done, failed, running, missing, and the time it took and will take."""

import os
import time
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

from doe import clearance
from doe.running.failure import Failure, grouped
from doe.running.owner import folders_of
from doe.running.store import Claim, EndedRun, RunResult, Store
from doe.study.runs import STORE, ordered_runs
from doe.study_file import Study
from rbdyn.faults import InputError

FORMAT = "doe.status/1"


def study_status(study: Study, folder: Path) -> dict[str, Any]:
    """Record of ``doe status``. Changes nothing, not even while the study runs. Raises InputError."""
    ordered = ordered_runs(study)
    points = clearance.points_of(ordered.scenes, ordered.labels, ordered.factors)
    outcomes, claims, ended = dict[str, RunResult](), list[Claim](), list[EndedRun]()
    if (folder / STORE).exists():
        with Store(folder / STORE, read_only=True) as store:
            outcomes, claims, ended = store.outcomes(points, clearance.sound), store.claims(), store.ended()
    keys = {point.key for point in points}
    failures = [outcome for outcome in outcomes.values() if isinstance(outcome, Failure)]
    claims = [claim for claim in claims if claim.key not in outcomes]
    running = [claim for claim in claims if claim.key in keys]
    missing = len(keys) - len(outcomes) - len(running)
    others = [run.status for run in ended if run.key not in keys]
    return {
        "format": FORMAT,
        "status": "finished" if missing + len(running) == 0 else "running" if claims else "unfinished",
        "study": str(study.path),
        "store": str(folder / STORE),
        "points": {
            "total": len(keys),
            "done": len(outcomes) - len(failures),
            "failed": len(failures),
            "running": len(running),
            "missing": missing,
        },
        "failures": grouped(failures),
        "running": [_running(claim) for claim in claims],
        "other": {
            "done": others.count("done"),
            "failed": others.count("failed"),
            "running": len(claims) - len(running),
        },
        "spent_s": sum(run.seconds or 0.0 for run in ended if run.key in keys),
        "left_s": _left_s(missing + len(running), claims, [run for run in ended if run.key in keys]),
    }


def folder_of(study: Study) -> Path:
    """Folder in which the study runs, or its usual one while it does not. Raises InputError where it runs in several."""
    running = folders_of(study.path)
    if len(running) > 1:
        folders = " and in ".join(map(str, running))
        raise InputError([f"{study.path}: runs in {folders}; name one of them by --out"])
    return running[0] if running else Path(f"{study.path.stem}_results")


def _running(claim: Claim) -> dict[str, Any]:
    return {
        **{key: getattr(claim, key) for key in ("label", "run", "host", "pid")},
        "since": datetime.fromtimestamp(claim.since, UTC).isoformat(timespec="seconds"),
        "for_s": max(0.0, time.time() - claim.since),
    }


def _left_s(left: int, claims: list[Claim], ended: list[EndedRun]) -> float | None:
    """Wall time that the rest takes: at the pace of the processes at work, else at that of all processors here.

    None while nothing has ended that could tell.
    """
    if left == 0:
        return 0.0
    owners = {claim.owner for claim in claims}
    fresh = [run for run in ended if run.owner in owners and run.started is not None]
    if fresh:
        begun = min(run.started for run in fresh if run.started is not None)
        return left * (fresh[-1].ended - begun) / len(fresh)
    seconds = [run.seconds for run in ended if run.seconds is not None]
    if not seconds:
        return None
    return left * sum(seconds) / len(seconds) / min(os.cpu_count() or 1, left)
