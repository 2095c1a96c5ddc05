"""Sentences: those of the manual and the README are whole and short, and a note begins with one."""

import re

from prose import PAGES, ROOT, SOURCES, TOP_PAGES, VERBS, notes, sentences, words_of

LONGEST_SENTENCE = 30
# Pages that are lists of titles or of terms.
LISTS = {"61_glossary.md", "73_references.md"}
# What needs no verb: the title of the README, the caption of its picture, and links at the end of a page.
TITLES = ("Design clearances and tolerances", "*Example study", "See also: ")
# Topics of a note before its first clause, and notes whose verb is a value.
TOPICS = re.compile(r"(?:[\w'.=-]+(?: [\w'.=-]+){0,4}: )+")
FILLED = ("The region of the X X from X",)


def test_invariant_pages_have_whole_and_short_sentences():
    """Invariant: each sentence of running text has a verb and at most 30 words; labels and lists have no sentences."""
    pages = [page for page in (*PAGES, *TOP_PAGES) if page.name not in LISTS]
    found = [(page.name, each) for page in pages for each in sentences(page.read_text(encoding="utf-8"))]
    found = [each for each in found if not each[1].startswith(TITLES)]
    assert len(found) > 700 and not VERBS.search("Rolling resistance over the whole range of loads.")
    assert [each for each in found if len(words_of(each[1])) > 3 and not VERBS.search(each[1])] == []
    assert [each for each in found if len(words_of(each[1])) > LONGEST_SENTENCE] == []


def test_invariant_a_note_begins_with_a_sentence():
    """Invariant: the first clause of a note has a verb, behind its topic if it has one; values of the program are X."""
    found = [(f"{path.relative_to(ROOT)}:{line}", text) for path in SOURCES for line, text in notes(path)]
    starts = [(place, text[topic.end() if (topic := TOPICS.match(text)) else 0 :]) for place, text in found]
    clauses = [(place, re.split("[;:.] ", text)[0]) for place, text in starts]
    whole = [each for each in clauses if len(words_of(re.sub(r"\bX+\b", "", each[1]))) > 1]
    assert len(whole) > 60 and not VERBS.search("of a jitter")
    assert [each for each in whole if not VERBS.search(each[1]) and not each[1].startswith(FILLED)] == []
