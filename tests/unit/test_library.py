"""The functions of ``doe``: they do what the commands do, and their answers show, tabulate and save themselves."""

import json
import pickle
from html.parser import HTMLParser
from pathlib import Path
from types import SimpleNamespace

import pandas as pd
import pytest
from doe_command import doe as command
from instant_runs import instantly, unillustrated
from short_studies import short_study

import doe
from rbdyn.base.blocks import Remarks, Section, Table, Widget
from rbdyn.base.notes import Note

EXAMPLES = Path(__file__).parents[2] / "examples"
ROLLERS = EXAMPLES / "cylindrical_roller.toml"
UNCERTAIN = """
[uncertain]
defaults = "none"
points = 16
"cage.mass_g" = { law = "normal", mean = 45.0, sd = 3.0 }
"cage.guide_clearance_mm" = { law = "uniform", low = 0.1, high = 0.2 }
"""


class Text(HTMLParser):
    """Tags and text of HTML, with the tags that were never closed."""

    def __init__(self, text: str) -> None:
        super().__init__()
        self.tags, self.words, self.open = [], "", []
        self.feed(text)

    def handle_starttag(self, tag, attributes):
        self.tags.append(tag)
        self.open.append(tag)

    def handle_endtag(self, tag):
        assert self.open.pop() == tag

    def handle_data(self, data):
        self.words += data


@pytest.fixture(scope="module")
def work(tmp_path_factory):
    """An answer of each function with the arguments of its command, on simulations that take no time."""
    folder = tmp_path_factory.mktemp("library")
    path = short_study(folder)
    scene = folder / "scene.toml"
    scene.write_text(ROLLERS.read_text(encoding="utf-8") + UNCERTAIN, encoding="utf-8")
    chains, point = folder / "chains.toml", {"pocket_clearance_mm": 0.25}
    text = (EXAMPLES / "bearing_chains.toml").read_text(encoding="utf-8")
    chains.write_text(text.replace("[[chain]]\n", "[[chain]]\nmonte_carlo = { samples = 2000 }\n"), encoding="utf-8")
    told = []
    with pytest.MonkeyPatch.context() as patch:
        instantly(patch.setattr)
        unillustrated(patch.setattr)
        patch.setattr("doe.unknown.propagation.REFITS", 4)
        patch.setattr("doe.workflow.uncertainty.OUTPUTS", ("impact_force_N",))
        patch.setattr("doe.workflow.uncertainty.MOST", 16)
        answers = {
            "study": doe.study(str(path), folder / "out", progress=lambda *heard: told.append(heard)),
            "uncertainty": doe.uncertainty(
                scene, target=0.5, overrides=["lubricant.temperature_C=90"], out=folder / "sets"
            ),
            "design": doe.design(path),
            "fit": doe.fit(path, folder / "out" / "design_runs.csv", out=str(folder / "fit")),
            "front": doe.front(path, folder / "out" / "design_runs.csv", point=point),
            "chain": doe.chain(chains),
        }
        runs = ("--data", str(folder / "out" / "design_runs.csv"))
        told_by = {
            "study": (path, "--out", folder / "out"),
            "uncertainty": (scene, "--target", "50%", "--set", "lubricant.temperature_C=90", "--out", folder / "sets"),
            "design": (path,),
            "fit": (path, *runs),
            "front": (path, *runs, "--point", "pocket_clearance_mm=0.25"),
            "chain": (chains,),
        }
        yield SimpleNamespace(answers=answers, commands=told_by, told=told, folder=folder)


@pytest.mark.parametrize("name", ["study", "uncertainty", "design", "fit", "front", "chain"])
def test_unit_function_answers_as_its_command(work, name, capsys):
    """Unit: the same JSON, the same text; an answer can be pickled, its line is short, its dict is the caller's own."""
    answer = work.answers[name]
    shown = command(name, *map(str, work.commands[name]), "--json")
    assert shown.returncode == 0, shown.stderr
    assert json.loads(shown.stdout) == json.loads(json.dumps(answer.as_dict())) == answer
    printed = command(name, *map(str, work.commands[name])).stdout
    text = str(answer)
    if name == "study":  # what was finished before is printed as its answer.txt
        assert printed.startswith((work.folder / "out" / "answer.txt").read_text(encoding="utf-8"))
    else:
        assert printed.startswith(text)
    assert text.count("\n") > 5 and "Answer: " not in text
    kept = pickle.loads(pickle.dumps(answer))
    assert kept == answer and kept._repr_html_() == answer._repr_html_() and str(kept) == text
    line = repr(answer)
    assert (
        line.startswith(f"<{type(answer).__name__}: ") and line.endswith(">") and len(line) < 400 and line.isprintable()
    )
    answer.as_dict().clear()
    assert len(answer) == len(answer.as_dict()) > 1
    assert capsys.readouterr().out == ""


@pytest.mark.parametrize("name", ["study", "uncertainty", "design", "fit", "front", "chain"])
def test_unit_answer_has_tables_and_shows_itself_in_a_notebook(work, name, tmp_path):
    """Unit: every table has rows, the first is the main one; the page is whole HTML with every figure of the main table."""
    answer = work.answers[name]
    tables = answer.tables
    main, *_ = tables
    assert answer.table().equals(tables[main]) and answer.table(main).equals(tables[main])
    assert all(isinstance(table, pd.DataFrame) and len(table) and len(table.columns) > 1 for table in tables.values())
    with pytest.raises(doe.InputError, match=rf"name = 'x': is not a table of this answer; choose one of {main}, "):
        answer.table("x")
    page = Text(answer._repr_html_())
    assert page.open == [] and "table" in page.tags and "script" not in page.tags
    assert ("details" in page.tags) == (name in ("study", "fit"))  # later chapters, long tables
    answer.save(tmp_path / "answer.json")
    assert json.loads((tmp_path / "answer.json").read_text(encoding="utf-8")) == answer


def test_unit_answers_hold_the_figures_of_their_records(work):
    """Unit: tables of numbers in the units of their names, from the record alone."""
    study, sets, fit = (work.answers[name] for name in ("study", "uncertainty", "fit"))
    gains, pick = study.table().set_index("response"), study.table("pick").set_index("factor")
    assert gains["pick"].to_dict() == {
        name: one["value"] for name, one in study["confirmation"]["pick"]["responses"].items()
    }
    assert pick["pick"].to_dict() == study["pick"] and pick["baseline"]["pocket_clearance_mm"] == 0.3
    assert len(study.table("runs")) == 20 and set(study.table("parts")["chain"]) == set(study["chains"])
    csv = pd.read_csv(work.folder / "fit" / "coefficients.csv")
    pd.testing.assert_frame_equal(csv, fit.table("coefficients"), check_dtype=False)
    written = {"fit.json", "anova.csv", "coefficients.csv", "runs.csv", "report.html", "tables.xlsx"}
    assert set(fit.files) == written and all((fit.folder / name).is_file() for name in written)
    ranges = sets.table().set_index("output")
    assert (ranges["low_5_percent"] < ranges["high_95_percent"]).all() and len(sets.table("sets")) == sets["runs"] == 16
    assert work.answers["front"]["point"]["factors"]["pocket_clearance_mm"] == 0.25
    assert set(work.answers["front"].table("picks")["point"]) > {"baseline", "knee"}


def test_unit_progress_names_the_stages(work):
    """Unit: runs are told by stage, each to its end; a finished study is not done again."""
    stages = list(dict.fromkeys(stage for stage, _, _ in work.told))
    assert stages[:2] == ["baseline", "design runs"] and any(stage.startswith("confirmation") for stage in stages)
    assert ("design runs", 20, 20) in work.told
    again = doe.study(work.commands["study"][0], work.folder / "out", progress=lambda *_: pytest.fail("ran again"))
    assert again == work.answers["study"] and again.finished_before and not work.answers["study"].finished_before


def test_unit_a_page_of_a_notebook_escapes_every_text():
    """Unit: marks of HTML in any text are shown as such; pictures that need scripts are left out; the rest folds."""

    class Marked(doe.Answer):
        def blocks(self):
            marked = '<b onclick="x()">&'
            notes = Remarks((Note("remark", marked),))
            return [notes, Widget("surface"), Table(marked, (marked, "y"), [(marked, marked)], note=marked)]

        def sections(self):
            return [Section("a", "first", self.blocks()), Section("b", "<i>second</i>", self.blocks())]

    page = Text(Marked({})._repr_html_())
    assert {"b", "i", "script"}.isdisjoint(page.tags) and page.tags.count("details") == 1 and page.open == []
    assert page.words.count('<b onclick="x()">&') >= 10 and "<i>second</i>" in page.words
