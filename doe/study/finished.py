"""Whether a study lies finished in its folder, so that nothing needs to be done again."""

import json
from contextlib import suppress
from pathlib import Path
from typing import Any

from doe.study_file import Study
from rbdyn.faults import InputError, read_toml
from rbdyn.records.kept import digest_of, intact
from rbdyn.records.sources import source_digest
from rbdyn.result import read_json, versions

# What simulates, what judges, and what tells it.
CODE = ("rbdyn.dynamics.simulate", "doe.study.whole", "doe.report.study.files")


def inputs_digest(study: Study, adaptive: bool = False, robust: bool = False) -> str:
    """Hash of all that the files of a study depend on: the study, the files it names, the code, what was asked."""
    named = [study.scene.file, *(chain.file for chain in study.file.chain)]
    named += [] if study.file.reference is None else [study.file.reference.file]
    named += [study.file.design.augment, *_samples(study)]
    asked = json.dumps([adaptive, robust, versions()], sort_keys=True)
    texts = study.path.name, study.file.model_dump_json(), asked, source_digest(*CODE)
    files = (_content(study.beside(name)) for name in named if name is not None)
    return digest_of(b"".join([*(text.encode() for text in texts), *files]))


def finished(folder: Path, digest: str) -> dict[str, Any] | None:
    """The record of a finished study of these inputs, as it was written, whose files are all there; else None."""
    try:
        record = read_json(folder / "summary.json")
        whole = (
            intact(record)
            and record["inputs"] == digest
            and all(map(Path.is_file, map(folder.joinpath, record["files"])))
        )
        whole = whole and record["answer_sha256"] == digest_of((folder / "answer.txt").read_bytes())
    except (OSError, ValueError, KeyError, TypeError, AttributeError):
        return None
    return record if whole else None


def _samples(study: Study) -> list[str]:
    """The posterior sample of unknown inputs that the study or, without such a table there, its scene names."""
    if study.file.uncertain is not None:
        return list(filter(None, [study.file.uncertain.sample]))
    with suppress(InputError):
        declared = read_toml(study.beside(study.scene.file)).get("uncertain")
        if isinstance(declared, dict) and isinstance(name := declared.get("sample"), str):
            return [str(Path(study.scene.file).parent / name)]
    return []


def _content(path: Path) -> bytes:
    """Bytes of a file; of one that cannot be read, which the study refuses later, none."""
    try:
        return path.read_bytes()
    except (OSError, ValueError):
        return b""
