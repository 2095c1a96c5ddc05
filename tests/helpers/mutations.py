"""What fuzz tests share: mutations of files, and whether a mutated file is read or refused in sentences."""

import random
import re
import time
from collections.abc import Callable
from pathlib import Path

from rbdyn.base.faults import LONGEST_SENTENCE, MOST_FAULTS, InputError

SECONDS = 2.0
TOKEN = re.compile(rb"\"[^\"\n]*\"|[\w.+-]+|[^\w\s]|\n")
EXTREMES = [
    b"0", b"-1", b"1e300", b"-1e-300", b"1e400", b"inf", b"nan", b"9" * 25, b"9" * 5000, b"true", b"2020-01-01", b"1e-12",
    b'""', b"'x'", b"[]", b"{}", b"[" * 150, b"\\u0000", b'"' + b"y" * 5000 + b'"', b"0x" + b"f" * 40, b"07:00:00", b"null",
    b"1,5", b";", b"Key", b".a" * 40, b"\xef\xbb\xbf", b"\xe9", b"\x00", b'"""', b"1_000", b"1e154", b"2147483648", b"5e-324",
]  # fmt: skip


def mutated(random: random.Random, data: bytes) -> bytes:
    """The bytes with one to three changes: of tokens, numbers, keys, lines or bytes."""
    for _ in range(random.choice((1, 1, 2, 3))):
        tokens = list(TOKEN.finditer(data))
        if not tokens:
            return data
        start, end = random.choice(tokens).span()
        other = random.choice(tokens)
        numbers = [each for each in tokens if each[0][:1].isdigit()]
        lines = data.splitlines(keepends=True)
        line = random.randrange(len(lines))
        kind = random.randrange(10)
        if kind == 0:
            data = data[:start] + data[end:]
        elif kind == 1:
            data = data[:start] + other[0] + data[start:]
        elif kind == 2:
            data = data[:start] + other[0] + data[end:]
        elif kind in (3, 4, 5) and numbers:
            start, end = random.choice(numbers).span()
            data = data[:start] + random.choice(EXTREMES) + data[end:]
        elif kind == 6:
            data = data[: random.randrange(len(data))]
        elif kind == 7:
            data = b"".join([*lines[:line], lines[line], *lines[line:]])
        elif kind == 8:
            at = random.randrange(len(data))
            data = data[:at] + random.randbytes(random.randrange(1, 5)) + data[at + random.randrange(3) :]
        else:
            data = data[:start] + data[start:end].swapcase() + b"_" * random.randrange(2) + data[end:]
    return data


def outcome(read: Callable[[Path], object], path: Path) -> str:
    """Whether the file is read or refused; anything else fails."""
    start = time.perf_counter()
    try:
        end = "read" if read(path) is not None else "nothing"
    except InputError as error:
        end = "refused"
        assert 1 <= len(error.faults) <= MOST_FAULTS
        for fault in error.faults:
            assert fault.isprintable() and 10 < len(fault) <= LONGEST_SENTENCE, fault
    assert time.perf_counter() - start < SECONDS
    return end
