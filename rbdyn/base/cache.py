"""Caches on disk: the folder of a user's caches, and contents signed by their digest."""

import hashlib
import os
from pathlib import Path

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
