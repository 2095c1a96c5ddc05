"""One tree of blocks, two renderings: the same figures with the same digits on a terminal and as HTML."""

import html
import re
from dataclasses import replace

import pytest
from synthetic_study import RESPONSES, motion, searched, summary

from doe.report.files import answer_text, blocks
from doe.report.page import html_report, sections
from doe.report.summary import Summary
from rbdyn.base import html as page
from rbdyn.base import terminal
from rbdyn.base.blocks import Bullets, Detail, Heading, Paragraph, Remarks, Section, Table, with_notes
from rbdyn.base.notes import Note
from rbdyn.base.records import plain

NUMBER = re.compile(r"[-+±]?\d+(?:\.\d+)?(?:e[-+]?\d+)?")
PICTURE = re.compile(r"<figure.*?</figure>|<details class=\"controls\".*?</details>", re.DOTALL)


def numbers(text: str) -> list[str]:
    """All figures of a text, in their order, with their signs and digits."""
    return NUMBER.findall(text.replace("± ", "±"))


def of_html(text: str) -> list[str]:
    """Figures of the words of HTML; of pictures none."""
    words = re.sub(r"<[^>]*>", " ", PICTURE.sub("", text))
    return numbers(html.unescape(words).replace("\xa0", " "))


def of_terminal(part: Section) -> list[str]:
    """Figures on a page without an end: there no table is broken, so none stands twice."""
    rows = [terminal.text([block], Detail.ALL, 10_000) for block in part.blocks]
    return numbers("".join(rows))


def record() -> dict:
    """The made-up study with everything that an answer can say."""
    whole = summary()
    limit = {"sense": "<=", "bound": 260.0, "value": 231.472, "error": 0.0057, "verdict": "kept", "probability": 0.99}
    for name in ("baseline", "pick"):
        whole["confirmation"][name] |= {
            "limits": {RESPONSES[2]: limit},
            "every_limit": [{"response": RESPONSES[2], **limit}],
        }
    whole["limits"] = {RESPONSES[2]: {**limit, "odds": None}}
    whole["edge"]["sentence"] = "The selected design lies 0.05 mm inside of the region."
    whole["adaptive"] = searched()
    whole["tolerances_sentence"] = "95 % of the parts keep the gain of 3.25 ± 0.41 %."
    return whole


@pytest.mark.parametrize("section", sections(Summary.from_dict(record()), motion()), ids=lambda section: section.key)
def test_every_section_has_the_same_figures_in_both_renderings(section):
    """Terminal and HTML of one section: the same numbers to the digit, in the same order.

    Tiles have their own order on a page, which shows a figure with all that belongs to it together.
    """
    ours = of_terminal(section)
    assert ours or section.key in ("notes", "motion", "surfaces")
    tiles = any(isinstance(block, Table) and block.tiles is not None for block in section.blocks)
    arranged = sorted if tiles else list
    assert arranged(ours) == arranged(of_html(page.section(section).partition("</h2>")[2]))


def test_a_whole_study_has_the_same_figures_as_its_sections():
    """The files of a study: report.html holds the numbers of the tree, answer.txt those of its answer."""
    tree = sections(Summary.from_dict(record()))
    body = html_report(Summary.from_dict(record())).partition('<section id="answer"')[2].partition("</main>")[0]
    parts = re.split(r'<section id="', body)
    assert len(parts) == len(tree)
    # The verdict in the first line counts responses, limits and warnings.
    answer = numbers(answer_text(Summary.from_dict(record())).partition("\n")[2])
    shown = replace(tree[0], blocks=[block for block in tree[0].blocks if block.detail < Detail.ALL])
    assert set(of_terminal(shown)) <= set(answer)
    assert set(answer) <= {*of_terminal(tree[0]), *of_terminal(tree[-1])}
    assert set(answer) <= set(numbers(terminal.text(blocks(Summary.from_dict(record())))))
    assert "231.4720 ± 0.0057" in answer_text(Summary.from_dict(record())) and "231.4720 ± 0.0057" in body.replace(
        "&nbsp;", " "
    )


def test_no_key_stands_in_what_people_read():
    """Words, never keys: neither factors nor responses by their names in the record."""
    whole = record()
    text = answer_text(Summary.from_dict(whole)) + terminal.text(blocks(Summary.from_dict(whole)), Detail.ALL)
    for name in [*RESPONSES, *whole["pick"]]:
        assert name not in text, name


def test_every_block_is_rendered_twice_and_details_are_for_who_asks():
    """Unit: each kind of block on the terminal and as HTML; quietly no notes, only verbosely all."""
    tree = [
        Paragraph("A verdict of 5 %.", "statement"), Remarks((Note("remark", "a limit of 1.5"),)), Heading("Parts"), Bullets(["one of 2"]),
        Table("Sizes", ("part", "size"), [("ring & <b>", "1.0 ± 0.2")], "in mm", detail=Detail.ALL),
        Table("Clearances", ("", "pick", "baseline"), [("guide [mm]", "0.185", "0.150")], tiles=()),
    ]  # fmt: skip
    quiet, usual, full = (terminal.text(tree, detail) for detail in Detail)
    assert "note:" not in quiet and "note: a limit of 1.5" in usual and "1.0 ± 0.2" not in usual
    assert "ring & <b>" in full and full.index("Sizes") < full.index("in mm")
    written = "".join(map(page.render, tree))
    assert "ring &amp; &lt;b&gt;" in written and "baseline 0.150 mm" in written


def test_a_terminal_breaks_sentences_between_words():
    """Unit: at 40 columns no line is longer and no word is broken; a file keeps a sentence in one line."""
    sentence = "The closing link is -0.0150 to 0.0483 mm in worst case, 0.0053 to 0.0368 mm by root sum square."
    lines = terminal.text([Paragraph(sentence)], width=40).splitlines()
    assert max(map(len, lines)) <= 40 and " ".join(lines) == sentence
    assert terminal.text([Paragraph(sentence)]) == f"{sentence}\n"


def test_bad_news_has_a_word_and_a_class_of_its_own():
    """Unit: a warning begins with that word in all renderings, and no class of good news is on it."""
    block = Paragraph("LIMIT BROKEN at the selected design: power loss <= 250.", "warning")
    written = page.render(block)
    assert 'class="warning"' in written and "Warning:" in written and "statement" not in written
    assert terminal.text([block]).startswith("Warning: LIMIT BROKEN")
    assert terminal.text([block], width=80, bold=True).startswith("\033[1mWarning: ")


def long_notes(count: int, code: str = "unit") -> tuple[Note, ...]:
    """Long notes that say different things."""
    return tuple(Note(code, f"{number}: {number * 'more '}{'word ' * 30}end") for number in range(count))


def test_a_screen_has_five_notes_and_says_where_the_others_are():
    """Unit: below full detail the first five, remarks cut at the width, warnings whole, for they end with what to do; a file has
    them whole; at full detail all; general ones in files alone.
    """
    tree = [Paragraph("before"), Remarks((Note("left-out", "general"), *long_notes(8, "remark"))), Paragraph("after")]
    lines = terminal.text(tree, width=80).splitlines()
    assert [line[:7] for line in lines[1:6]] == [f"note: {number}" for number in range(5)]
    assert all(len(line) <= 80 and line.endswith("…") for line in lines[1:6])
    assert lines[6].startswith("4 more notes in the report") and lines[7:] == ["after"]
    whole = terminal.text(tree)
    assert whole.count("end\n") == 5 and "4 more notes in the report" in whole and "general" not in whole
    assert terminal.text(tree, Detail.ALL, 80).count("end") == 8 and "Note: general" in "".join(map(page.render, tree))
    assert "in full" in terminal.text([Remarks(long_notes(3, "remark"))], width=80)
    warned = terminal.text([Remarks(long_notes(3))], width=80)
    assert warned.count("end\n") == 3 and max(map(len, warned.splitlines())) <= 80
    assert "report" not in warned and "report" not in terminal.text([Remarks(long_notes(3, "remark"))])


def test_dangers_come_first_even_quietly_and_take_the_place_of_notes():
    """Unit: every danger before anything else in all renderings; of six notes five are shown, the dangers among them."""
    notes = (
        Note("dent", "inner raceway: dented by 5 MPa"),
        Note("dent", "outer raceway: dented by 4 MPa"),
        Note("heat", "hot"),
    )
    notes = (*long_notes(5), *notes)
    tree = with_notes([*plain(notes[:3]), *notes[3:]], [Heading("answer")])
    quiet = terminal.text([Paragraph("bearing"), *tree], Detail.LEAST).splitlines()
    assert (
        quiet[:2] == ["Danger: hot", "Danger: inner raceway: dented by 5 MPa; likewise outer raceway"]
        and "warning" not in quiet[-1]
    )
    lines = terminal.text(tree).splitlines()
    assert [line[:2] for line in lines[lines.index("Warnings") + 1 :]] == ["1.", "2.", "3.", "2 "]
    assert lines[-1].startswith("2 more notes")
    assert 'class="danger"' in page.render(tree[0])
    assert terminal.text(with_notes((), [])) == "No danger found\n"
    assert terminal.text(with_notes(long_notes(2), [])).startswith("No danger found; 2 warnings\n")
