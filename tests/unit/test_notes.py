"""Notes: a sentence with its code and level."""

import pickle

import pytest

from rbdyn.base.notes import Level, Note


def test_a_note_is_its_sentence_with_code_and_level():
    note = pickle.loads(pickle.dumps(Note("seizure", "the guide clearance is lost")))
    assert (note, note.code, note.level) == ("the guide clearance is lost", "seizure", Level.DANGER)
    assert note.as_dict() == {"level": "danger", "code": "seizure", "text": "the guide clearance is lost"}


def test_a_code_that_is_not_listed_is_refused():
    with pytest.raises(KeyError):
        Note("unlisted", "text")
