"""Still pictures: the same text for the same marks, colours of the page, numbers in their places, matplotlib only when drawn."""

import os
import re
import subprocess
import sys
from functools import partial
from importlib.resources import files
from xml.etree import ElementTree

import matplotlib
import numpy as np
import pytest
from matplotlib.image import imread
from synthetic_study import RESPONSES, motion, summary

from doe.report.page import sections
from doe.report.sections.answer import power_bars
from doe.report.sections.chain import FILLS, contributions
from doe.report.sections.fit import diagnostic_plots
from doe.report.still import COLOURS, Still, name_marks, save
from doe.report.summary import Summary
from rbdyn.base.blocks import Figures

POINTS = [(0.0, 10.0), (1.0, 30.0), (4.0, 20.0)]
# Loads every section of a study, prints what was loaded of matplotlib before and after one picture is drawn.
LAZY = """
import sys
from doe.report.page import sections
from doe.report.summary import Summary
from rbdyn.base.blocks import Figures
from synthetic_study import motion, summary
stills = [each for part in sections(Summary.from_dict(summary()), motion()) for block in part.blocks
          if isinstance(block, Figures) for each in block.pictures if not isinstance(each, str)]
print(len(stills), "matplotlib" in sys.modules)
stills[0]()
print("matplotlib" in sys.modules, "matplotlib.pyplot" in sys.modules, "numba" in sys.modules)
"""


def marked(titles, axis):
    """Three points with titles."""
    name_marks(axis.plot(*zip(*POINTS, strict=True), "o")[0], "run", titles)


def stills() -> list[Still]:
    """All still pictures of the made-up study."""
    blocks = [
        block
        for part in sections(Summary.from_dict(summary()), motion())
        for block in part.blocks
        if isinstance(block, Figures)
    ]
    return [each.__self__ for block in blocks for each in block.pictures if not isinstance(each, str)]


def test_matplotlib_is_loaded_where_a_picture_is_drawn_and_not_before():
    found = subprocess.run([sys.executable, "-c", LAZY], capture_output=True, text=True, check=True, env=environment())
    assert found.stdout.split() == [str(len(stills())), "False", "True", "False", "False"]


def environment() -> dict[str, str]:
    """The paths of this process for another one."""
    return os.environ | {"PYTHONPATH": os.pathsep.join(filter(None, sys.path))}


def test_the_same_marks_are_the_same_text_whatever_was_drawn_before():
    still = Still("three points", partial(marked, ["a", "b", "c"]))
    first = still.svg()
    Still("others", partial(marked, [])).svg()
    with matplotlib.rc_context({"font.size": 30.0, "svg.fonttype": "path", "axes.grid": False}):
        assert still.svg() == first


def test_marks_lie_where_their_numbers_are():
    """Titles stand at their marks in order; places are the points, scaled alike along each axis."""
    root = ElementTree.fromstring(Still("three points", partial(marked, ["first", "second", "third"])).svg())
    uses = [each for group in root.iter("g") if group.get("class") == "run" for each in group.findall("use")]
    assert [each.findtext("title") for each in uses] == ["first", "second", "third"]
    for key, values in (("x", [x for x, _ in POINTS]), ("y", [-y for _, y in POINTS])):
        places = np.array([float(each.get(key)) for each in uses])
        slope, offset = np.polyfit(values, places, 1)
        assert slope > 0.0 and places == pytest.approx(slope * np.array(values) + offset, abs=0.1)


def test_light_colours_are_those_of_the_style_sheet():
    sheet = files("rbdyn.base").joinpath("report.css").read_text(encoding="utf-8")
    light = dict(re.findall(r"--(\w+): (#[0-9a-f]{6})", sheet.partition("@supports")[0]))
    assert {role: light[role] for role in COLOURS} == COLOURS


@pytest.mark.parametrize("still", stills(), ids=lambda still: still.words)
def test_every_picture_is_coloured_by_its_page_and_refers_to_nothing_outside(still):
    """Dark mode and paper: every colour is a role; only shares of a chain have colours of their own, with letters to match."""
    text = still.svg()
    ElementTree.fromstring(text)
    fixed = set(re.findall(r"#[0-9a-f]{6}\b", re.sub(r'(?:href|id)="[^"]*"', "", text)))
    assert not fixed or still.words.startswith("Contributions to the chain")
    assert not fixed & set(COLOURS.values())
    assert not re.search(r"url\(|https?:|font-family|<!--|\bnan\b", text)
    assert "var(--" in text and f'aria-label="{still.words}"'.replace("'", "&#x27;") in text
    defined = re.findall(r'<path id="(\w+)"', text)
    assert len(set(defined)) == len(defined) and set(re.findall(r'href="#(\w+)"', text)) <= set(defined)


def test_dollars_and_quotes_of_a_name_stay_as_they_are():
    runs = Summary.from_dict(summary()).fit.responses[RESPONSES[0]].diagnostics.runs
    name = 'a$b$ <i> "c" & d_mm'
    text = diagnostic_plots(name, runs)[0].svg()
    words = [each.text for each in ElementTree.fromstring(text).iter("text")]
    assert 'observed a$b$ <i> "c" & d [mm]' in words


def test_bars_are_as_long_as_their_numbers_and_bear_them():
    still = power_bars(["land", "drag"], {"baseline": {"land": 70.0, "drag": 35.0}, "pick": {"land": 14.0}})
    text = still.svg()
    words = [each.text for each in ElementTree.fromstring(text).iter("text")]
    assert {"70", "35", "14", "0", "baseline", "pick", "power loss [W]"} <= set(words)
    edges = [re.findall(r"[ML](-?[\d.]+) ", d) for d in re.findall(r'd="(M[^"]*z)"', text)]
    lengths = sorted(max(map(float, each)) - min(map(float, each)) for each in edges)[-3:]
    assert lengths == pytest.approx([lengths[-1] * share for share in (0.2, 0.5, 1.0)], abs=0.3)


def test_shares_of_a_chain_fill_their_bar():
    percents = {"bore": 75.0, "land": 23.0, "rim": 2.0}
    shares = {name: {"variance_percent": value, "worst_case_percent": 0.0} for name, value in percents.items()}
    words = [
        each.text for each in ElementTree.fromstring(f"<p>{contributions('guide', shares).svg()}</p>").iter("text")
    ]
    assert not {colour for pair in FILLS for colour in pair} & set(COLOURS.values())
    # The least share has no room for its number; all parts are in the legend; what is not known has no bar.
    assert {"1: 75 %", "2: 23 %", "1: bore", "2: land", "3: rim", "variance"} <= set(words)
    assert "3: 2 %" not in words and "worst case" not in words


def test_a_file_holds_the_pictures_in_rows(tmp_path):
    """As PNG on white paper: four of them two in a row, five with three in a row, and where there is none nothing."""
    still = Still("three points", partial(marked, []))
    save([still] * 4, tmp_path / "four.png")
    image = imread(tmp_path / "four.png")[..., :3]
    high, wide = image.shape[0] // 2, image.shape[1] // 2
    assert image.shape[:2] == pytest.approx((2 * 270 * 130 / 72, 2 * 340 * 130 / 72), abs=2)
    inked = [(part < 0.99).any() for half in (image[:high], image[high:]) for part in (half[:, :wide], half[:, wide:])]
    assert inked == [True] * 4
    save([still] * 5, tmp_path / "five.png")
    image = imread(tmp_path / "five.png")[..., :3]
    assert image.shape[:2] == pytest.approx((2 * 270 * 130 / 72, 3 * 340 * 130 / 72), abs=2)
    assert (image[: image.shape[0] // 2, -image.shape[1] // 3 :] < 0.99).any()
    assert not (image[image.shape[0] // 2 :, -image.shape[1] // 3 :] < 0.99).any()
