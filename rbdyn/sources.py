"""The source code of a package as one hash: code that was edited gives results and compiled code of its own."""

from __future__ import annotations

import functools
import hashlib
from pathlib import Path


@functools.cache
def source_digest(package: Path = Path(__file__).parent) -> str:
    """SHA-256 of every source file of a package, this one by default, as it lies on disk at the first call."""
    digest = hashlib.sha256()
    for source in sorted(package.rglob("*.py")):
        digest.update(source.read_bytes())
    return digest.hexdigest()
