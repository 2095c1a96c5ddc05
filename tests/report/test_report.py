"""The report of a study as text: what it says, what it leaves out, and that no name can break it."""

import copy
import json
import re
from html import unescape
from html.parser import HTMLParser
from importlib.resources import files
from itertools import pairwise
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
from short_studies import paper_study
from synthetic_study import FACTORS, RESPONSES, VERDICT, motion, pocket_chain, summary

from doe.report.files import response_surface
from doe.report.page import LETTERS, SCRIPTS, html_report, packed
from doe.report.sections.answer import MEANINGS
from doe.report.sections.chain import yield_words
from doe.report.sections.fit import _coefficient
from doe.report.sections.front_pictures import error_bars
from doe.report.still import Still
from doe.report.summary import Summary, change
from doe.unknown.decision import GainChances
from doe.unknown.propagation import Share
from doe.workflow.confirmation import Gain
from doe.workflow.judgement import ConfirmedGain, Robust, RobustFront
from doe.workflow.pick import Outward
from doe.workflow.runs import EstimatedValue, read_runs
from doe.workflow.surfaces import fit_surfaces
from rbdyn.base.words import label, quantity, rounded_down, shown, with_error
from rbdyn.plots.roller import cage_orbit
from rbdyn.scene import Scene

EXAMPLES = Path(__file__).parents[2] / "examples"
VOID = {"meta", "input"}
SECTIONS = (
    "answer", "identity", "asked", "design", "surfaces", "diagnostics", "front", "confirmation", "chains", "power", "motion",
    "reference", "settings", "notes",
)  # fmt: skip


class Outline(HTMLParser):
    """Checks that elements are closed in order; collects ids, links, text outside scripts, and attributes."""

    def __init__(self, page: str) -> None:
        super().__init__()
        self.open: list[str] = []
        self.ids: list[str] = []
        self.links: list[str] = []
        self.words: list[str] = []
        self.remote: list[str] = []
        self.feed(page)
        self.close()

    def handle_starttag(self, tag, attrs):
        given = dict(attrs)
        self.ids += [given["id"]] if "id" in given else []
        self.links += [given["href"].removeprefix("#")] if tag == "a" else []
        self.remote += [given[name] for name in ("src", "srcset", "xlink:href", "action") if name in given]
        if tag not in VOID:
            self.open.append(tag)

    def handle_startendtag(self, tag, attrs):
        pass

    def handle_endtag(self, tag):
        assert self.open.pop() == tag

    def handle_data(self, data):
        if self.open and self.open[-1] not in ("script", "style"):
            self.words.append(data.replace("\xa0", " "))


@pytest.fixture(scope="module", autouse=True)
def stills():
    """Pictures of the same marks are drawn once for all the pages of these tests."""
    drawn, draw = {}, Still.svg
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(Still, "svg", lambda still: drawn.get(repr(still)) or drawn.setdefault(repr(still), draw(still)))
        yield drawn


@pytest.fixture(scope="module")
def page():
    return html_report(Summary.from_dict(summary()), motion())


def data_of(page: str) -> dict:
    (data,) = re.findall(r'<script type="application/json" id="data">(.*?)</script>', page, re.DOTALL)
    return json.loads(data)


def test_page_is_whole_small_and_fetches_nothing(page):
    outline = Outline(page)
    assert outline.open == [] and outline.remote == []
    assert len(outline.ids) == len(set(outline.ids))
    assert set(outline.links) <= set(outline.ids)
    assert not re.search(r"https?://|url\(|@import|\bfetch\(|XMLHttpRequest|import\(", page)
    assert "default-src 'none'" in page
    assert len(page.encode()) < 250_000


def test_answer_comes_first(page):
    words = " ".join(Outline(page).words)
    answer = words[words.index("Skip to the answer") : words.index("What was asked", words.index("radial clearance"))]
    for text in (
        "0.0225",
        "0.1850",
        "± 0.0040 mm",
        "The gain is real",
        "9.240 0/-0.005",
        "11.16 ± 0.65 % less",
        "▲ better",
        yield_words(pocket_chain()),
    ):
        assert text in answer
    assert "impact force [N]" in answer and "impact_force_N" not in answer


def test_every_section_is_in_the_contents(page):
    outline = Outline(page)
    assert outline.links[1:] == [*SECTIONS]


def test_power_terms_that_are_nil_everywhere_are_left_out(page):
    words = " ".join(Outline(page).words)
    power = words[words.index("Power loss by term") :]
    assert "land" in power and "zero everywhere are left out" in power
    assert ">nil<" not in page


def test_pick_is_the_one_that_the_study_stands_by():
    record = summary()
    plain = record["front"]["pick"]
    # The study has picked with tolerances, at the resolution of the drawing; the surfaces picked another point.
    aware = record["front"]["front"][9]
    record["front"]["picks"]["tolerance_aware"] = record["pick_on_surfaces"] = aware
    record["pick"] = {name: round(x, 3) for name, x in aware["factors"].items()}
    record["confirmation"]["pick"] |= {
        "factors": record["pick"],
        "gains": {RESPONSES[0]: VERDICT | {"percent": 5.5}},
        "statement": "",
    }
    record["confirmation"]["pick"]["reason"] = "by what manufacture leaves of it"
    record["confirmation"]["without_tolerances"] = record["confirmation"].pop("knee") | {"factors": plain["factors"]}
    text = html_report(Summary.from_dict(record))
    compared = data_of(text)["compared"]
    assert compared["pick"]["x"] == pytest.approx(list(aware["factors"].values()), rel=1e-5)
    assert compared["without_tolerances"]["x"] == pytest.approx(list(plain["factors"].values()), rel=1e-5)
    words = " ".join(Outline(text).words)
    assert "Why this point: by what manufacture leaves of it." in words
    simulated = words[words.index("predicted by the surfaces and simulated, design selected without tolerances") :]
    # Its own simulated gain, not that of the selected design.
    assert "11.16 ± 0.65 % less" in simulated[:400] and "5.5" not in simulated[:200]


def test_tolerances_are_never_rounded_up():
    assert [rounded_down(x) for x in (0.001875, 0.0125, 0.005, 0.1, 12.9, 0.0)] == [
        *("0.0018", "0.012", "0.0050", "0.10", "12", "0")
    ]


def test_without_motion_nothing_moves():
    outline = Outline(html_report(Summary.from_dict(summary())))
    assert "bearing" not in outline.ids and "motion" not in outline.links


def spoilt(record, name):
    """The record with another factor name wherever the first one stands."""
    return json.loads(json.dumps(record).replace(FACTORS[0], json.dumps(name)[1:-1]))


@pytest.mark.parametrize("name", ["</script><b>bold</b>", "a<!--b", "{{DATA}} & 'c'", 'd" onload="e', "|pipe|*star*"])
def test_no_name_breaks_the_page(name, page):
    spoiled = html_report(Summary.from_dict(spoilt(summary(), name)), motion())
    outline = Outline(spoiled)
    assert outline.open == []
    assert data_of(spoiled)["factors"][0]["name"] == name
    assert spoiled.count("<script") == page.count("<script") and spoiled.count("<!--") == page.count("<!--")
    assert "<b>" not in spoiled and ' onload="' not in spoiled
    assert quantity(name)[0] in " ".join(outline.words)


def test_nan_never_appears():
    record = summary()
    fit = record["fit"]["responses"][RESPONSES[0]]
    fit["r2"] = fit["diagnostics"]["runs"][0]["cook"] = None
    record["design"]["points"][0]["responses"] = {}
    text = html_report(Summary.from_dict(record), motion())
    told = " ".join(Outline(text).words) + json.dumps(data_of(text))
    assert not re.search(r"\b(nan|NaN|inf|Infinity|None|null ±)\b", re.sub(r"null", "", told))
    assert "failed" in told


def test_record_is_left_as_it_was():
    record = summary()
    before = copy.deepcopy(record)
    html_report(Summary.from_dict(record), motion())
    assert record == before


def test_data_are_the_points_of_the_record(page):
    record, data = summary(), data_of(page)
    points = sorted(record["front"]["front"], key=lambda each: each["responses"][RESPONSES[0]])
    assert [each["words"] for each in data["fronts"]] == ["on the surfaces", "with tolerances"]
    for ours, theirs in zip(data["fronts"][0]["points"], points, strict=True):
        assert ours["x"] == pytest.approx(list(theirs["factors"].values()), rel=1e-5)
        assert ours["y"] == pytest.approx(list(theirs["responses"].values()), rel=1e-5)
    # 8 runs less 4 terms would be a Student factor of its own; the record has 16 degrees of freedom.
    assert data["surfaces"][0]["student"] == pytest.approx(2.1199, abs=1e-4)


def places_of(path: str) -> list[tuple[float, float]]:
    """Where the lines of a path by steps begin."""
    places, place = [], np.zeros(2)
    for letter, *step in re.findall(r"(m| |(?=-))(-?[\d.]+) ?(-?[\d.]+)", path):
        place = place + np.array(step, float)
        if letter == "m":
            places.append(tuple(place))
    return places


def test_every_point_of_the_front_is_where_scripts_look_for_it(page):
    """Three pairs of responses by the axes that each picture states, and as many lines over parallel axes."""
    data = data_of(page)
    pictures = re.findall(r'<svg[^>]* data-front="([^"]*)">(.*?)</svg>', page, re.DOTALL)
    assert [json.loads(unescape(axes))["kind"] for axes, _ in pictures] == ["pair"] * 3 + ["parallel"]
    for axes, picture in pictures:
        stated = json.loads(unescape(axes))
        left, upper, right, lower = stated["frame"]
        for role, front in zip(("front", "robust"), data["fronts"], strict=True):
            if stated["kind"] == "parallel":
                threads = re.search(rf'<g class="threads {role}"[^>]*>(.*?)</g>', picture)[1]
                assert threads.count("<path") == len(front["points"])
                continue
            dots = places_of(re.search(rf'<g class="dots {role}"><path d="([^"]*)"', picture)[1])
            (_, i, low, high), (_, j, least, most) = stated["axes"]
            y = np.array([point["y"] for point in front["points"]])
            across = left + (right - left) * (y[:, i] - low) / (high - low)
            up = lower - (lower - upper) * (y[:, j] - least) / (most - least)
            assert np.array(dots) == pytest.approx(np.column_stack([across, up]), abs=0.11)


def test_packed_numbers_are_close_and_zero_is_exact():
    numbers = [0.0, -12.34, 700.0, 0.1, 0.0]
    record = packed(numbers)
    code = {letter: k for k, letter in enumerate(LETTERS)}
    pairs = zip(record["letters"][::2], record["letters"][1::2], strict=True)
    back = [record["step"] * (record["first"] + 64 * code[a] + code[b]) for a, b in pairs]
    assert back[0] == back[-1] == 0.0
    assert back == pytest.approx(numbers, abs=0.51 * record["step"]) and record["step"] < 712.5 / 4000.0
    assert packed([5.0, 5.0])["letters"] == packed([0.0, 0.0])["letters"] == "AAAA"


def test_scripts_and_styles_are_in_the_package():
    names = [name for part in SCRIPTS.values() for name in part]
    parts = [*names, "surface.html", "front.html", "bearing.html"]
    places = [files("doe.report").joinpath("html", name) for name in parts]
    places += [files("rbdyn.base").joinpath(name) for name in ("report.css", "page.html")]
    for place in places:
        text = place.read_text(encoding="utf-8")
        assert 0 < len(text.splitlines()) < 400
        assert "</script" not in text


@pytest.mark.parametrize(
    ("value", "error", "text"),
    [(87.0943, 0.352, "87.09 ± 0.35"), (239.4076, 0.0441, "239.408 ± 0.044"), (1234.5, 120.0, "1230 ± 120"),
     (231.472, 0.0057, "231.4720 ± 0.0057"), (5.0, 0.0996, "5.00 ± 0.10"), (1234.5, 99.6, "1230 ± 100"),
     (2.5e9, 1.23e7, "2.500e9 ± 0.012e9"), (2.31e-12, 1.24e-13, "2.31e-12 ± 0.12e-12"),
     (0.367, None, "0.367"), (0.367, 0.0, "0.367"), (0.367, float("nan"), "0.367"), (float("nan"), 1.0, ""), (None, 1.0, "")],
)  # fmt: skip
def test_errors_have_two_digits(value, error, text):
    assert with_error(value, error) == text


def test_names_and_numbers_are_written_for_people():
    assert [label(name) for name in ("impact_force_N", "cage_slip", "N", "speed_rpm")] == [
        "impact force [N]", "cage slip", "N", "speed [rpm]",
    ]  # fmt: skip
    assert [shown(x) for x in (None, True, 3, 24000.0, 1.23456e-5, float("inf"), [0.1, 2])] == [
        "", "yes", "3", "24000", "1.235e-05", "", "0.1, 2",
    ]  # fmt: skip
    assert shown(-3.1e-17) == "0"
    assert _coefficient(-6.986e-05, 0.0086) == "-0.0001 ± 0.0086" and _coefficient(None, None) == "–"
    assert change(Gain(9.963, 4.462)) == "10.0 ± 4.5 % less"
    assert change(Gain(-3.0, 0.5, "max")) == "3.00 ± 0.50 % less"
    assert change(Gain(3.0, 0.5, "target")) == "3.00 ± 0.50 % off target less"


def test_cards_carry_units_and_say_what_a_clearance_is():
    whole = summary()
    words = " ".join(Outline(html_report(Summary.from_dict(whole))).words)
    assert len(re.findall(r"baseline [\d.]+ mm", words)) == len(whole["asked"]["factors"])
    keys = [each["key"] for each in whole["asked"]["factors"]]
    assert ("Clearances: " in words) == any(key in MEANINGS for key in keys)


def test_error_bars_end_at_the_frame():
    bars = error_bars((5.0, 0.5), (2.0, 7.0), ((0.0, 10.0), (0.0, 1.0)))
    assert bars == [[(3.0, 0.5), (7.0, 0.5)], [(5.0, 0.0), (5.0, 1.0)]]
    assert error_bars((5.0, 0.5), (None, 0.25), ((0.0, 10.0), (0.0, 1.0))) == [[(5.0, 0.25), (5.0, 0.75)]]


def test_beyond_the_edge_each_response_has_direction_and_unit():
    figures = {"impact_force_N": (0.2, 0.4), "power_loss_W": (-0.5, 0.1), "cage_speed_rpm": (3.0, 1.0)}
    gains = {name: EstimatedValue(*figure) for name, figure in figures.items()}
    outward = Outward("upper", 0.25, "µm", "simulation", gains)
    told = outward.sentence("guide_clearance_mm", {"cage_speed_rpm": "max"})
    assert (
        "The selected design is at the upper bound of guide_clearance_mm, 0.25 mm. Extrapolated change per µm beyond it by simulation"
        in told
    )
    assert (
        "impact_force_N 0.20 ± 0.40 N less, power_loss_W 0.50 ± 0.10 W more, cage_speed_rpm 3.0 ± 1.0 rpm more" in told
    )


def test_pictures_keep_their_words_off_the_curves(monkeypatch, tmp_path):
    """The legend of the orbits lies outside all axes; the surfaces name their third axis, and their ticks keep apart."""
    from matplotlib.figure import Figure

    kept = {}
    monkeypatch.setattr(Figure, "savefig", lambda figure, path, **options: kept.update({path: figure}))
    orbit = SimpleNamespace(
        guide_eccentricity=(np.linspace(-66e-6, -43e-6, 9), np.linspace(19e-6, 39e-6, 9)),
        time=np.linspace(0.0, 1e-3, 9),
        cage_angle=np.linspace(0.0, 1.0, 9),
        scene=Scene.load(EXAMPLES / "cylindrical_roller.toml"),
    )
    cage_orbit({"baseline": orbit, "pick": orbit}, "orbit")
    figure = kept["orbit"]
    figure.canvas.draw()
    (box,) = (legend.get_window_extent() for legend in figure.legends)
    assert not any(box.overlaps(axis.get_window_extent()) for axis in figure.axes)
    assert not any(axis.get_legend() for axis in figure.axes[:4])
    for axis in figure.axes[4:]:
        assert not axis.get_legend().get_window_extent().overlaps(axis.get_window_extent())
    cage_orbit({"one": orbit}, "one")
    kept["one"].canvas.draw()
    for axis in [*figure.axes, *kept["one"].axes]:
        boxes = [each.get_window_extent() for each in axis.get_xticklabels() if each.get_text()]
        assert not any(one.overlaps(two.padded(18.0)) for one, two in pairwise(boxes))
    study = paper_study()
    response_surface(study, fit_surfaces(study, read_runs(study, EXAMPLES / "ccd_table4.csv"))[0], "surface")
    for axis, held in zip(kept["surface"].axes, ("pocket clearance 0.3 mm", "guide clearance 0.15 mm"), strict=True):
        assert axis.get_zlabel() == "impact force [N]" and held in axis.get_title()
        assert all(len(ticks) <= 6 for ticks in (axis.get_xticks(), axis.get_yticks(), axis.get_zticks()))


def test_the_odds_of_the_gains_follow_these():
    """Odds that are no good news warn; names of responses are spelt, points of the robust front stand in a table."""
    names = RESPONSES
    sentence = "Of 100 cases the selected design is better in all of these in 57 (51 to 63): the gains depend on what is not known."
    better = dict.fromkeys(names, Share(0.8, 0.7, 0.9))
    odds, factors = GainChances(better, Share(0.57, 0.51, 0.63)), dict.fromkeys(FACTORS, 0.1)
    front = RobustFront([], [ConfirmedGain("robust knee", "", factors, dict.fromkeys(names, 0.031), odds)], {})
    robust = Robust(
        chances=odds, undecided=None, pair=None, halved=0.6, front=front, explained=dict.fromkeys(names, 0.9), inputs=[],
        screened={}, pairs=128, runs=256, doubtful=0, sentences=[sentence],
    )  # fmt: skip
    record = summary() | {"robust": robust.as_dict()}
    page = html_report(Summary.from_dict(record), motion())
    words = " ".join(Outline(page).words)
    assert f'class="warning"><strong>Warning:</strong> {sentence}' in page and "Add --robust" not in page
    assert words.index("Changes confirmed") < words.index(sentence) < words.index("Over the unknown inputs")
    sure = record | {"robust": record["robust"] | {"all": [0.97, 0.94, 0.99]}}
    assert f'class="statement">{sentence}' in html_report(Summary.from_dict(sure))
    assert "3.1 %, 80 (70 to 90)" in words and "57 (51 to 63)" in words
