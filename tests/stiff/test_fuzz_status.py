"""``doe status`` of any store: whatever was noted, run, killed or spoilt, it says finished of an answer only."""

import json
import random
import sqlite3
import warnings
from pathlib import Path

import pytest
from instant_runs import instant_result
from short_studies import short_study

from doe.clearance import points_of
from doe.commands.functions import status_blocks
from doe.running.runner import NOTE, agenda_in
from doe.running.store import STORE, Store
from doe.workflow.problem import Problem
from doe.workflow.status import inputs_digest, study_stages, study_status
from rbdyn.base.faults import InputError
from rbdyn.base.files import digest_of, sign
from rbdyn.base.terminal import show

OPTIONS = ({}, {"adaptive": True}, {"robust": True})
SPOILT = ("", "{}", "[]", "null", "{", '{"stages": 5}', "\x00", '{"command": 1, "stages": []}')


def history(draw: random.Random, study: Problem, folder: Path, plans: dict) -> dict[str, int]:
    """A store as a command leaves it somewhere on its way; returns what is true of it."""
    given = draw.choice(OPTIONS)
    options = {"adaptive": False, "robust": False} | given
    digest = inputs_digest(study, **options) if draw.random() < 0.8 else "of another"
    ordered = study.plan
    points = points_of(ordered.scenes, ordered.labels, ordered.factors)
    result = instant_result(ordered.scenes[0]).as_dict()
    ended, taken = draw.randint(0, len(points)), draw.randint(0, 3)
    truth = {"answer": 0, "failed": 0, "ended": ended}
    if draw.random() < 0.9:
        with agenda_in(folder / STORE, "doe study", draw.randint(1, 8), options, digest) as keeper:
            keeper.plan([] if draw.random() < 0.1 else plans[tuple(given)]())
            for stage in draw.sample(keeper.agenda.stages, draw.randint(0, len(keeper.agenda.stages))):
                ahead = [each.name for each in keeper.agenda.stages[keeper.agenda.place :]]
                if stage.name in ahead:
                    keeper.enter(stage.name)
                    works = {f"{stage.name} {number}": draw.uniform(0.0, 100.0) for number in range(draw.randint(0, 9))}
                    keeper.counting(works, lambda done, total: None)(draw.randint(0, len(works)), len(works))
            if draw.random() < 0.3:
                keeper.finish(["answer.txt"])
    with Store(folder / STORE) as store:
        for point in points[:ended]:
            if draw.random() < 0.1:
                store.fail(point.key, "it broke", seconds=draw.uniform(0.0, 9.0))
                truth["failed"] += 1
            else:
                store.put(point.key, result, seconds=draw.choice([None, 0.0, 3.0, 1e5]))
        # The process is killed: what it has under way stays, its notes too.
        for point in points[ended : ended + taken]:
            store.begin(point)
    if draw.random() < 0.3:
        with sqlite3.connect(folder / STORE) as connection:
            connection.execute("UPDATE meta SET value = ? WHERE name LIKE ?", (draw.choice(SPOILT), f"{NOTE}%"))
    if draw.random() < 0.8:
        # An answer, of these inputs or of others, whole or not.
        record = {"inputs": draw.choice([digest, inputs_digest(study, **options), "other"]), "files": ["answer.txt"]}
        record["answer_sha256"] = digest_of(b"it")
        sign(record)
        (folder / "summary.json").write_text(draw.choice([json.dumps(record)] * 4 + ["{", "[]"]), encoding="utf-8")
        if draw.random() < 0.7:
            (folder / "answer.txt").write_text("it", encoding="utf-8")
            truth["answer"] = 1
    return truth


@pytest.mark.slow
def test_invariant_status_of_any_history_is_true(tmp_path, fuzz_cases, capsys):
    """Invariant: nothing runs where no process lives, counts add up, finished needs an answer and leaves no run."""
    draw, seen = random.Random(11), {"finished": 0, "unfinished": 0}
    study = Problem.load(short_study(tmp_path))
    plans = {tuple(given): (lambda given=given: study_stages(study, **given)) for given in OPTIONS}
    for case in range(fuzz_cases):
        folder = tmp_path / str(case)
        folder.mkdir()
        truth = history(draw, study, folder, plans)
        with warnings.catch_warnings():
            warnings.simplefilter("error")
            try:
                record = study_status(study, folder)
            except InputError as error:
                pytest.fail(f"case {case}: {error}")
            show(status_blocks(record))
        shown = capsys.readouterr().out
        seen[record["status"]] += 1
        points = record["points"]
        assert points["running"] == 0 and record["running"] == [] and record["other"]["running"] == 0, case
        assert points["done"] + points["failed"] == truth["ended"] and points["failed"] == truth["failed"], case
        assert sum(points[kind] for kind in ("done", "failed", "running", "missing")) == points["total"] == 20, case
        if record["status"] == "finished":
            inputs = json.loads((folder / "summary.json").read_text())["inputs"]
            assert truth["answer"] and inputs != "other" and record["runs_left"] == [0, 0], case
        else:
            assert 0 <= record["runs_left"][0] <= record["runs_left"][1], case
        assert all(each["done"] >= 0 and each["runs"] >= 0 for each in record["stages"]), case
        assert shown.isprintable() or all(line.isprintable() for line in shown.splitlines()), case
        json.dumps(record, allow_nan=False)
    assert min(seen.values()) > 0.1 * fuzz_cases, seen
