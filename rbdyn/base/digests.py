"""Digests that tell stale files from valid ones: of source code, of the contents of a cache; and the folder of caches.

The digest of code covers only what runs: modules that the roots import, directly or through others, without docstrings,
comment lines and imports for typing. An edit of a picture, a command or the description of a key leaves it unchanged.
"""

import functools
import hashlib
import os
import re
from collections.abc import Mapping, Sequence
from pathlib import Path
from types import MappingProxyType

SITE = Path(__file__).parents[2]
# Packages that draw or print, which changes no figure.
SILENT = ("rbdyn.plots", "rbdyn.cli")
# A string in triple quotes that has its lines for itself is a docstring. Both cases begin with a fixed letter, so that the search
# passes over all others.
_PROSE = re.compile(r'\n[ \t]*(?:#.*|"""[\s\S]*?"""(?P<rest>.*))|"""[\s\S]*?"""(?P<code>.*)')
_TYPING = re.compile(r"^if TYPE_CHECKING:\n(?:[ \t]+.*\n|\n)+", re.MULTILINE)
_IMPORT = re.compile(r"^[ \t]*from ([\w.]+) import (\([^)]*\)|.*)$", re.MULTILINE)
# Mark of a module with kernels: an import of their decorators, or a body of a law.
_KERNELS = re.compile(
    r"^from rbdyn\.compiled\.kernel import .*\b(?:entry|\w*kernel|law|law_of|routine|INLINED)\b|^@[\w.]+\.body\(",
    re.MULTILINE,
)


@functools.cache
def source_digest(*roots: str) -> str:
    """SHA-256 of the code that modules such as ``rbdyn.dynamics.simulate`` run, as it lies on disk at the first call."""
    return _digest(code_behind(roots))


@functools.cache
def compiled_digest() -> str:
    """SHA-256 of the code from which machine code is made: every module of kernels and what it imports."""
    texts = {path: path.read_text(encoding="utf-8") for path in (SITE / "rbdyn").rglob("*.py")}
    parts = [path.relative_to(SITE).with_suffix("").parts for path, text in texts.items() if _KERNELS.search(text)]
    return _digest(code_behind([".".join(names) for names in parts], texts))


def code_behind(roots: Sequence[str], texts: Mapping[Path, str] = MappingProxyType({})) -> dict[str, str]:
    """Modules of these packages that the roots need, each with the text that runs. ``texts``: files read before."""
    packages = {"rbdyn", *(root.partition(".")[0] for root in roots)}
    code: dict[str, str] = {}
    waiting, visited = list(roots), set[str]()
    while waiting:
        module = waiting.pop()
        if module in visited or module.startswith(SILENT):
            continue
        visited.add(module)
        path = _path(module)
        if path is None:
            continue
        code[module] = what_runs(texts[path] if path in texts else path.read_text(encoding="utf-8"))
        for package, names in _IMPORT.findall(code[module]):
            if package.partition(".")[0] in packages:
                waiting += [package, *(f"{package}.{name}" for name in re.findall(r"\w+", names))]
    return code


@functools.cache  # a command states several digests, of much the same modules
def what_runs(text: str) -> str:
    """Source text without docstrings, comment lines, empty lines and imports for typing only."""

    def code_of(match: re.Match[str]) -> str:
        return match[0] if match["rest"] or match["code"] is not None else ""

    bare = _PROSE.sub(code_of, f"\n{text}")
    return "\n".join(line for line in _TYPING.sub("", bare).splitlines() if line.strip())


def _digest(code: Mapping[str, str]) -> str:
    digest = hashlib.sha256()
    for module, text in sorted(code.items()):
        digest.update(f"{module}\n{text}\n".encode())
    return digest.hexdigest()


def _path(module: str) -> Path | None:
    """File of a module or package; None for another name."""
    base = SITE.joinpath(*module.split("."))
    return next((path for path in (base.with_suffix(".py"), base / "__init__.py") if path.is_file()), None)


DIGEST_BYTES = hashlib.sha256().digest_size


def with_digest(content: bytes) -> bytes:
    """The content behind its digest."""
    return hashlib.sha256(content).digest() + content


def content_of(data: bytes) -> memoryview:
    """Inverse of ``with_digest``. Raises ValueError where digest and content do not agree."""
    content = memoryview(data)[DIGEST_BYTES:]
    if hashlib.sha256(content).digest() != data[:DIGEST_BYTES]:
        raise ValueError("the content does not have the digest before it")
    return content


def user_cache() -> Path | None:
    """``XDG_CACHE_HOME``, else ``.cache`` in the user's home; None where there is no home."""
    if folder := os.environ.get("XDG_CACHE_HOME"):
        return Path(folder).absolute()
    try:
        return Path.home() / ".cache"
    except RuntimeError:
        return None
