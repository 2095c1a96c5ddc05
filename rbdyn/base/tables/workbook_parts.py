"""Parts of a workbook: an archive of XML files, unpacked and parsed piece by piece within bounds of bytes and seconds."""

import io
import posixpath
import time
import zipfile
from collections.abc import Callable, Mapping
from pathlib import Path
from xml.parsers import expat

from rbdyn.base.faults import InputError

# Most parts, most bytes of a part once it is unpacked, and most bytes of a single tag or comment, deepest nesting of tags.
MOST_PARTS, LARGEST_PART, LONGEST_TAG, DEEPEST, PIECE = 10_000, 50_000_000, 1_000_000, 100, 65536
# Seconds of processor time that a part may take; a sheet as large as the bounds takes five.
LONGEST_S = 8.0
ENTRY = b"PK\x01\x02"
WAYS = (zipfile.ZIP_STORED, zipfile.ZIP_DEFLATED)

Start = Callable[[str, Mapping[str, str]], None]


class DamageError(Exception):
    """A workbook that no spreadsheet writes; the message says where."""


class Parts:
    """The parts of a workbook with ``data``. Every method raises InputError for a damaged or too large one."""

    def __init__(self, path: Path, data: bytes) -> None:
        self.path, self._end = path, time.thread_time() + LONGEST_S
        # An entry of the directory takes half a kilobyte of memory.
        if data.count(ENTRY) > MOST_PARTS:
            raise self.too_large(f"has more than {MOST_PARTS} parts")
        try:
            self._archive = zipfile.ZipFile(io.BytesIO(data))
        # A damaged directory of parts can raise anything.
        except Exception:
            raise self.damaged("its archive") from None

    def damaged(self, place: str) -> InputError:
        """The fault of a workbook that is damaged at a place."""
        return InputError([f"{self.path}: is a damaged workbook ({place}); open it in Excel and save it anew"])

    def too_large(self, words: str) -> InputError:
        """The fault of a workbook beyond a bound."""
        return InputError([f"{self.path}: {words}; save the table alone in a new workbook or as CSV"])

    def related(self, name: str) -> dict[str, tuple[str, str]]:
        """Kind and name by identity of the parts that a part refers to; of the whole archive for an empty name."""
        folder, file = posixpath.split(name)
        parts = dict[str, tuple[str, str]]()

        def start(tag: str, keys: Mapping[str, str]) -> None:
            if tag == "Relationship" and keys.get("TargetMode") != "External":
                target = posixpath.normpath(posixpath.join("/", folder, keys.get("Target", ""))).lstrip("/")
                parts[keys.get("Id", "")] = keys.get("Type", "").rpartition("/")[2], target

        self.parse(posixpath.join(folder, "_rels", f"{file}.rels"), start)
        return parts

    def parse(
        self,
        name: str,
        start: Start,
        end: Callable[[str], None] | None = None,
        text: Callable[[str], None] | None = None,
    ) -> None:
        """Read a part; ``start``, ``end`` and ``text`` get its tags, with local names and keys, and its text."""
        parser = expat.ParserCreate(namespace_separator=" ")
        parser.buffer_text = True
        depth = 0

        def started(tag: str, keys: Mapping[str, str]) -> None:
            nonlocal depth
            depth += 1
            if depth > DEEPEST:
                raise DamageError
            start(tag.rpartition(" ")[2], keys)

        def ended(tag: str) -> None:
            nonlocal depth
            depth -= 1
            if end is not None:
                end(tag.rpartition(" ")[2])

        def refuse(*declaration: object) -> None:
            raise DamageError

        parser.StartElementHandler, parser.EndElementHandler = started, ended
        if text is not None:
            parser.CharacterDataHandler = text
        # A workbook declares no entities: these could multiply a text without bound.
        parser.StartDoctypeDeclHandler = refuse
        try:
            info = self._archive.getinfo(name)
            if info.file_size > LARGEST_PART:
                raise self.too_large(f"part {name} unpacks to more than {LARGEST_PART / 1e6:g} MB")
            if info.compress_type not in WAYS:
                raise self.damaged(f"part {name}")
            with self._archive.open(info) as file:
                fed = 0
                while piece := file.read(PIECE):
                    parser.Parse(piece, False)
                    fed += len(piece)
                    if fed - parser.CurrentByteIndex > LONGEST_TAG:
                        raise DamageError
                    if time.thread_time() > self._end:
                        raise self.too_large(f"takes longer than {LONGEST_S:g} s to read")
                parser.Parse(b"", True)
        except (InputError, MemoryError):
            raise
        except DamageError as damage:
            raise self.damaged(f"part {name}{damage}") from None
        # A damaged part can raise anything in the libraries.
        except Exception:
            raise self.damaged(f"part {name}") from None
