"""Machine code on disk: loaded where it is as it was written, else made anew; nothing that lies there stops a run."""

import errno
import importlib.util
import logging
import sys
from pathlib import Path

import pytest
from cached_entries import ARGUMENTS, FUNCTIONS, fill, fresh, line
from numba import types

from rbdyn.base.digests import content_of
from rbdyn.compiled import kernel
from rbdyn.compiled.kernel import entry

BITS_OF_CODE = 40


def hits(compiled) -> int:
    """Signatures whose code was loaded."""
    return compiled.stats.cache_hits.total()


@pytest.fixture
def folder(tmp_path) -> Path:
    """A folder with the code of two functions for two signatures."""
    assert len(fill(tmp_path / "cache")) == 4
    return tmp_path / "cache"


def test_unit_code_is_loaded_for_its_own_function_and_signature(folder):
    """Unit: a new process loads each signature of each function, and compiles nothing."""
    for function in FUNCTIONS:
        compiled = fresh(function, folder)
        assert [compiled(x) for x in ARGUMENTS] == [function(x) for x in ARGUMENTS]
        assert (hits(compiled), compiled.stats.cache_misses.total()) == (2, 0)
    assert len(list(folder.iterdir())) == 4, "no unfinished file is left"


def test_unit_a_flipped_bit_of_machine_code_never_runs(folder):
    """Unit: no file with one bit changed is handed to the linker."""
    for path in folder.iterdir():
        data = path.read_bytes()
        for place in range(0, len(data), len(data) // BITS_OF_CODE):
            with pytest.raises(ValueError, match="digest"):
                content_of(data[:place] + bytes([data[place] ^ 4]) + data[place + 1 :])


def test_unit_a_changed_source_file_is_compiled_anew(tmp_path, monkeypatch):
    """Unit: code of an older text of the function's own file is not taken, and its file is replaced."""
    monkeypatch.setattr(sys, "dont_write_bytecode", True)
    for factor, loads in ((2, 0), (2, 1), (3, 0), (3, 1)):
        (tmp_path / "source.py").write_text(f"def times(x): return {factor} * x", encoding="utf-8")
        spec = importlib.util.spec_from_file_location("source", tmp_path / "source.py")
        module = importlib.util.module_from_spec(spec)
        monkeypatch.setitem(sys.modules, "source", module)
        spec.loader.exec_module(module)
        compiled = fresh(module.times, tmp_path / "cache")
        assert compiled(0.5) == 0.5 * factor and hits(compiled) == loads
    assert len(list((tmp_path / "cache").iterdir())) == 1


@pytest.mark.parametrize("fault", [errno.ENOSPC, errno.EROFS, errno.EDQUOT])
def test_unit_a_disk_that_takes_nothing_is_reported_once(tmp_path, monkeypatch, caplog, fault):
    """Unit: the run goes on without a cache; one sentence for all functions, and no unfinished file."""

    def full(path: Path, data: bytes) -> None:
        with path.open("wb") as file:
            file.write(data[:100])
        raise OSError(fault, "why")

    monkeypatch.setattr(Path, "write_bytes", full)
    with caplog.at_level(logging.WARNING, "rbdyn"):
        for function in FUNCTIONS:
            compiled = fresh(function, tmp_path / "cache")
            assert [compiled(x) for x in ARGUMENTS] == [function(x) for x in ARGUMENTS]
    (sentence,) = caplog.messages
    assert "(why)" in sentence and str(tmp_path) in sentence and sentence.isprintable()
    assert not list((tmp_path / "cache").iterdir())


def test_unit_a_file_in_place_of_the_folder_does_no_harm(tmp_path, caplog):
    """Unit: where the folder cannot be made the answer is the same."""
    (tmp_path / "cache").write_text("no folder", encoding="utf-8")
    compiled = fresh(line, tmp_path / "cache" / "of" / "code")
    assert compiled(0.5) == 2.5 and len(caplog.messages) == 1


def test_unit_without_a_home_nothing_is_kept(monkeypatch):
    """Unit: a user without a home directory has no cache, and no fault."""
    from rbdyn.base.digests import user_cache

    def homeless() -> Path:
        raise RuntimeError("Could not determine home directory.")

    monkeypatch.delenv("XDG_CACHE_HOME", raising=False)
    monkeypatch.setattr(Path, "home", homeless)
    assert user_cache() is None
    monkeypatch.setattr("rbdyn.compiled.kernel.cache_folder", lambda: None)
    compiled = entry(line)
    assert compiled(0.5) == 2.5 and compiled.stats.cache_path is None


def test_unit_named_tuples_of_one_name_have_files_of_their_own():
    """Unit: the name of a file tells apart types that numba writes alike."""
    from collections import namedtuple

    one, two = (namedtuple("Pair", "a b", module=module) for module in ("first", "second"))
    kinds = [types.NamedTuple((types.float64, types.int64), each) for each in (one, two)]
    assert str(kinds[0]) == str(kinds[1]) and len({kernel._text((kind,)) for kind in kinds}) == 2
