"""Output folders with files of somebody else, links, folders and other cases in the way: nothing that is not the command's is lost.

Each case fills a folder at random and runs a command there. A command that refuses changes nothing; one that runs writes over
files that it made itself, with ``--force`` also over others, never over one that it reads.
"""

import hashlib
import json
import os
import random
import shutil
from pathlib import Path

import pytest
from in_process import in_process

from rbdyn.base.folder import MARK, OWN

EXAMPLES = Path(__file__).parents[2] / "examples"
CHAIN, TABLE = EXAMPLES / "pocket_chain.toml", EXAMPLES / "ccd_table4.csv"
BALL = EXAMPLES / "angular_contact_ball.toml"
SWEEP = tuple(
    word
    for key in ("inner_speed_rpm=9000:9900:2", "axial_load_N=300:400:2", "radial_load_N=100:200:2")
    for word in ("--sweep", f"operation.{key}")
)
# Arguments of each command before and behind its input, and a file to read.
COMMANDS = {
    "chain": (("doe", "chain"), CHAIN, ()),
    "fit": (("doe", "fit", "--response", "power_loss_W", "--model", "linear", "--data"), TABLE, ()),
    "sweep": (("rbdyn", "ball"), BALL, SWEEP),
}


def digest(path: Path) -> str:
    """SHA-256 of a file, or where a link goes."""
    return f"-> {os.readlink(path)}" if path.is_symlink() else hashlib.sha256(path.read_bytes()).hexdigest()


def state(folder: Path) -> dict[str, str]:
    """All that is in a folder and below but what belongs to no result, by its path."""
    found = {path.relative_to(folder): path for path in folder.rglob("*") if path.name not in OWN}
    return {str(name): digest(path) for name, path in found.items() if path.is_symlink() or path.is_file()}


def in_other_case(name: str, draw: random.Random) -> str:
    """The name with capitals here and there."""
    return "".join(draw.choice((letter.upper(), letter)) for letter in name)


def fill(out: Path, precious: Path, names: list[str], draw: random.Random) -> dict[str, str]:
    """Put one to three things into the folder; returns by name what each is."""
    kinds = {}
    for name in draw.sample(names, draw.randint(1, 3)):
        kind = draw.choice(("file", "case", "link", "hard link", "broken link", "folder", "edited", "other name"))
        path = out / (in_other_case(name, draw) if kind == "case" else f"my_{name}" if kind == "other name" else name)
        if kind == "edited" and not path.is_file():
            continue
        if path.is_dir():
            continue
        path.unlink(missing_ok=True)
        if kind == "folder":
            path.mkdir()
        elif kind == "link":
            path.symlink_to(precious)
        elif kind == "hard link":
            os.link(precious, path)
        elif kind == "broken link":
            path.symlink_to("nowhere")
        else:
            path.write_text(f"{kind} {draw.random()}", encoding="utf-8")
        kinds[path.name] = kind
    return kinds


@pytest.fixture(scope="module")
def written(tmp_path_factory) -> dict[str, list[str]]:
    """Names of the files that each command writes into an empty folder."""
    names = {}
    for command, (before, source, behind) in COMMANDS.items():
        out = tmp_path_factory.mktemp(command) / "out"
        assert in_process(*before, source, *behind, "--out", out).returncode == 0
        names[command] = sorted({path.name for path in out.iterdir()} - OWN)
    return names


@pytest.mark.slow
def test_a_folder_keeps_what_a_command_did_not_make(tmp_path, written, fuzz_cases):
    refused = 0
    for number in range(fuzz_cases):
        draw, case = random.Random(number), tmp_path / str(number)
        command = draw.choice(list(COMMANDS))
        before, source, behind = COMMANDS[command]
        out, precious, names = case / "out", case / "precious", written[command]
        out.mkdir(parents=True)
        precious.write_text("precious", encoding="utf-8")
        # The input may lie in the folder, under a name of the results, or be known by a link to it.
        place = draw.choice(
            (
                case / source.name,
                out / source.name,
                out / draw.choice([name for name in names if not name.endswith("xlsx")]),
            )
        )
        read = Path(shutil.copy(source, place))
        if draw.random() < 0.3:
            made = in_process(*before, read, *behind, "--out", out)
            assert made.returncode == (2 if place.name in names else 0), (number, made.stderr)
        if draw.random() < 0.2:
            read = case / "input"
            draw.choice((os.symlink, os.link))(place, read)
        kinds = fill(out, precious, [name for name in names if out / name != place], draw)
        force = ["--force"] * (draw.random() < 0.4)
        earlier = state(case)
        shown = in_process(*before, read, *behind, "--out", out, *force)
        now = state(case)
        where = (number, command, kinds, place, force, shown.stderr)
        assert shown.returncode in (0, 2) and "Traceback" not in shown.stderr, where
        assert (
            digest(precious) == earlier["precious"]
            and now[str(place.relative_to(case))] == earlier[str(place.relative_to(case))]
        ), where
        foreign = {name for name, kind in kinds.items() if kind != "other name"}
        assert (shown.returncode == 2) == bool((place.parent == out and place.name in names) or "folder" in kinds.values() or (foreign and not force)), where  # fmt: skip
        if shown.returncode == 2:
            refused += 1
            assert shown.stderr.startswith("--out ") and now == earlier, where
            continue
        mark = json.loads((out / MARK).read_text(encoding="utf-8"))
        assert all(mark["files"][name] == digest(out / name) for name in names), where
        kept = {f"out/{name}" for name, kind in kinds.items() if kind in ("other name", "case")}
        assert all(now[name] == earlier[name] for name in kept - {f"out/{name}" for name in names}), where
    print(f"{fuzz_cases} cases, {refused} refused")
