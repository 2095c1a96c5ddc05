"""Files that begin with the SHA-256 of the rest, so that a reader sees whether they are as they were written."""

import hashlib

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
