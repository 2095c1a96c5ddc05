"""What compiled code and stored runs depend on: all that runs, and nothing that only describes or draws."""

import importlib
import io
import pkgutil
import tokenize

import pytest
from numba.core.dispatcher import Dispatcher

from rbdyn.base import digests
from rbdyn.base.digests import SITE, code_behind, compiled_digest, source_digest, what_runs

MODULES = sorted(path for name in ("rbdyn", "doe") for path in (SITE / name).rglob("*.py"))
SKIPPED = (tokenize.COMMENT, tokenize.NL, tokenize.NEWLINE, tokenize.INDENT, tokenize.DEDENT)


def tokens(text):
    """Tokens that run: without comments and docstrings, which are strings that stand alone on their line."""
    found, line = [], []
    for token in tokenize.generate_tokens(io.StringIO(text).readline):
        if token.type == tokenize.NEWLINE:
            if not (len(line) == 1 and line[0].type == tokenize.STRING):
                found += [each.string for each in line]
            line = []
        elif token.type not in SKIPPED:
            line.append(token)
    return found


def without_typing(text):
    """The text without its blocks for type checkers, found by indentation."""
    kept, inside = [], False
    for line in text.splitlines(keepends=True):
        inside = line.startswith("if TYPE_CHECKING:") or (inside and (line[0] in " \t\n"))
        kept += [] if inside else [line]
    return "".join(kept)


def test_oracle_nothing_that_runs_is_left_out():
    """Oracle: Python's own tokens of every module, docstrings and comments apart, are those that the hash reads."""
    for path in MODULES:
        text = path.read_text()
        assert tokens(flush(what_runs(text))) == tokens(flush(without_typing(text))), path


def flush(text):
    """Lines without indentation, which tells nothing of tokens and is missing where a body was a docstring alone."""
    return "".join(f"{line.strip()}\n" for line in text.splitlines())


@pytest.fixture
def copy(tmp_path, monkeypatch):
    """The packages in a folder where they may be edited, and how to edit one module."""
    for path in MODULES:
        target = tmp_path / path.relative_to(SITE)
        target.parent.mkdir(parents=True, exist_ok=True)
        target.write_text(path.read_text())
    monkeypatch.setattr(digests, "SITE", tmp_path)

    def edit(module, old, new):
        path = tmp_path / module
        text = path.read_text()
        assert old in text
        path.write_text(text.replace(old, new, 1))
        source_digest.cache_clear()
        compiled_digest.cache_clear()

    source_digest.cache_clear()
    compiled_digest.cache_clear()
    yield edit
    source_digest.cache_clear()
    compiled_digest.cache_clear()


@pytest.mark.parametrize(
    ("module", "old", "new"),
    [
        ("rbdyn/plots/roller.py", '"', "'"),
        ("rbdyn/scene/bearing.py", "Harmonics of the outer raceway", "Waves of the outer raceway"),
        ("rbdyn/scene/bearing.py", '"""Geometry of a cylindrical roller bearing.', '"""Drawing.'),
        ("rbdyn/cli/app.py", '"', "'"),
        ("doe/report/summary.py", '"', "'"),
    ],
)
def test_unit_words_and_pictures_invalidate_nothing(copy, module, old, new):
    """Unit: a picture, a command, a docstring or the description of a key leaves compiled code and stored runs alone."""
    before = compiled_digest(), source_digest("rbdyn.dynamics.simulate")
    copy(module, old, new)
    assert (compiled_digest(), source_digest("rbdyn.dynamics.simulate")) == before


@pytest.mark.parametrize(
    ("module", "old", "new"),
    [
        ("rbdyn/compiled/elementary.py", "0.5 * f * f", "0.25 * f * f"),
        ("rbdyn/dynamics/integrators/runge_kutta.py", "return ", "return 1.0 * "),
        ("rbdyn/contact/damping.py", "(1.0 + 1.5 * damping", "(1.0 + 1.6 * damping"),
    ],
)
def test_unit_a_law_invalidates_both(copy, module, old, new):
    """Unit: an edited law compiles again and runs again."""
    before = compiled_digest(), source_digest("rbdyn.dynamics.simulate")
    copy(module, old, new)
    assert compiled_digest() != before[0]
    assert source_digest("rbdyn.dynamics.simulate") != before[1]


def test_unit_a_default_runs_again_but_compiles_nothing(copy):
    """Unit: a changed default of a key changes figures, not machine code."""
    before = compiled_digest(), source_digest("rbdyn.dynamics.simulate")
    copy("rbdyn/scene/bearing.py", "inner_tilt_share: Fraction = 0.5", "inner_tilt_share: Fraction = 0.4")
    assert compiled_digest() == before[0]
    assert source_digest("rbdyn.dynamics.simulate") != before[1]


def kernels():
    """Modules in which anything is compiled."""
    names = [".".join(path.relative_to(SITE).with_suffix("").parts) for path in MODULES]
    return code_behind([n for n, path in zip(names, MODULES, strict=True) if digests._KERNELS.search(path.read_text())])


def test_invariant_compiled_code_knows_no_scene():
    """Invariant: what is compiled imports neither scenes nor tables, so keys and their checks compile nothing."""
    assert not [module for module in kernels() if module.startswith(("rbdyn.scene", "rbdyn.result", "doe"))]


def test_invariant_every_compiled_function_is_hashed():
    """Invariant: each dispatcher and each body of a law, wherever it is bound, comes from a module in the hash."""
    found = set()
    for module in pkgutil.walk_packages([str(SITE / "rbdyn")], "rbdyn."):
        if module.name.rpartition(".")[2] != "__main__":
            for each in vars(importlib.import_module(module.name)).values():
                if isinstance(each, Dispatcher):
                    found.add(each.py_func.__module__)
                if isinstance(bodies := getattr(each, "bodies", None), dict):
                    found |= {body.__module__ for body in bodies.values()}
    assert len(found) > 15
    assert found <= set(kernels())
