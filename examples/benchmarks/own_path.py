"""The whole path of a designer on the first day, from drawings that stand in no example: exit codes, times and screens.

``python examples/benchmarks/own_path.py [PATH]...`` walks all paths or the named ones in an empty folder (``--out DIR`` keeps it):
``drawing`` has a PEEK cage, fits, a jet of oil with heat, three points of operation from a table, a limit, tolerances and
chains; ``catalogue`` an NU 2208 of class P5 with clearance C3, fits and a limit on its life; ``impossible`` a limit that no
clearance keeps, which ends in a report; ``balls`` an angular contact bearing with preload.

Each step runs at 80 columns. The table has its exit code, wall and processor time; the last lines compare the processor time
of each path with that of the example study. The script ends with exit code 1 where a step ends otherwise than it should, a
run of a design fails, a screen is wider than 80 columns, or a study leaves no report.
"""

import argparse
import contextlib
import csv
import fcntl
import json
import os
import pty
import re
import resource
import shlex
import struct
import subprocess
import sys
import tempfile
import termios
import time
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import NamedTuple

ROOT = Path(__file__).resolve().parents[2]
COLUMNS = 80
ESCAPE = re.compile(r"\x1b\[[0-9;?]*[A-Za-z]")
DUTY = """\
name;share;operation.inner_speed_rpm;operation.radial_load_N
idle;0,15;4000;300
cruise;0,80;12000;1000
take-off;0,05;15000;1600
"""
BASIS = "example"
PATHS = {
    BASIS: (("doe study {examples}/clearance_study.toml --out study", 0),),
    "drawing": (
        (
            "rbdyn new own --rollers 14 --roller 8x8 --pitch 65 --cage-material PEEK --shaft k5 --housing H7 --oil-flow 0.4 "
            '--oil-inlet 60 --ambient 25 --lubrication jet --speed 12000 --load 1000 --oil "ISO VG 32" --out drawing.toml',
            0,
        ),
        # The hot cage takes the guide clearance that is estimated: a danger, which the study then avoids.
        ("rbdyn simulate drawing.toml --out run", 1),
        ("rbdyn simulate drawing.toml --duty duty.csv --out points", 1),
        ("doe new drawing.toml --duty duty.csv --limit power_loss_W<=900 --tolerances --chains --out study.toml", 0),
        ("doe study study.toml --out study", 0),
        ("doe status study.toml --out study", 0),
    ),
    "catalogue": (
        ("rbdyn new NU2208-E-XL-TVP2-P5-C3 --speed 6000 --load 3000 --shaft k5 --housing H7 --out my.toml", 0),
        ("rbdyn simulate my.toml --out run", 0),
        ("rbdyn compare run my.toml --set bearing.radial_clearance_mm=0.06", 0),
        ("doe new my.toml --limit life_h>=20000 --out study.toml", 0),
        ("doe study study.toml --out study", 0),
    ),
    "impossible": (
        (
            "rbdyn new own --rollers 12 --roller 9x10 --pitch 60 --cage-material polyamide --speed 7000 --load 2500 "
            '--oil "ISO VG 46" --out own.toml',
            0,
        ),
        ("doe new own.toml --limit impact_force_N<=5 --tolerances --chains --out study.toml", 0),
        ("doe study study.toml --out study", 1),
    ),
    "balls": (
        ("rbdyn new 7210B --speed 8000 --load 1500 --preload 900 --shaft k5 --housing H7 --out balls.toml", 0),
        ("rbdyn ball balls.toml --out run", 0),
        ("rbdyn compare balls.toml --set operation.preload_N=1200", 0),
    ),
}


class Step(NamedTuple):
    """A command with its exit code, the one it should have, wall and processor time [s], and what is wrong with it."""

    path: str
    command: str
    code: int
    expected: int
    wall: float
    processor: float
    faults: list[str]


def walk(path: str, folder: Path) -> Iterator[Step]:
    """The steps of a path, each as it ends; their output stands in the folder as step_N.txt."""
    folder.mkdir(parents=True, exist_ok=True)
    (folder / "duty.csv").write_text(DUTY, encoding="utf-8")
    for number, (command, expected) in enumerate(PATHS[path]):
        words = shlex.split(command.format(examples=ROOT / "examples"))
        words[0] = str(Path(sys.executable).with_name(words[0]))
        before, begin = resource.getrusage(resource.RUSAGE_CHILDREN), time.perf_counter()
        code, screen, errors = on_a_screen(words, folder)
        wall, after = time.perf_counter() - begin, resource.getrusage(resource.RUSAGE_CHILDREN)
        processor = after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime
        (folder / f"step_{number}.txt").write_text(f"$ {command}\n{screen}\n{errors}", encoding="utf-8")
        faults = [] if code == expected else [f"exit {code}, not {expected}"]
        faults += screen_faults(screen) + ["a traceback"] * ("Traceback" in errors)
        if words[1] == "study":
            faults += study_faults(folder / "study")
        yield Step(path, command, code, expected, wall, processor, faults)


def on_a_screen(words: Sequence[str], folder: Path) -> tuple[int, str, str]:
    """Exit code of a command whose standard output is a terminal, what that shows, and standard error, which is none."""
    outer, inner = pty.openpty()
    fcntl.ioctl(inner, termios.TIOCSWINSZ, struct.pack("HHHH", 50, COLUMNS, 0, 0))
    with tempfile.TemporaryFile("w+", encoding="utf-8") as errors:
        process = subprocess.Popen(words, cwd=folder, stdin=subprocess.DEVNULL, stdout=inner, stderr=errors)
        os.close(inner)
        shown = b"".join(_read(outer))
        os.close(outer)
        code = process.wait()
        errors.seek(0)
        return code, ESCAPE.sub("", shown.decode("utf-8")).replace("\r\n", "\n"), errors.read()


def _read(outer: int) -> Iterator[bytes]:
    """What is written to a terminal until nobody holds it any more."""
    with contextlib.suppress(OSError):
        while piece := os.read(outer, 65536):
            yield piece


def screen_faults(text: str) -> list[str]:
    """Lines wider than the screen, and tracebacks."""
    # A terminal breaks the list of files written anywhere.
    wide = sum(len(line) > COLUMNS and not line.startswith("written to ") for line in text.splitlines())
    return [f"{wide} lines wider than {COLUMNS} columns"] * (wide > 0) + ["a traceback"] * ("Traceback" in text)


def study_faults(out: Path) -> list[str]:
    """Files that are missing, and runs of the design that failed."""
    names = ("report.html", "answer.txt", "summary.json", "design_runs.csv")
    missing = [f"no {name}" for name in names if not (out / name).is_file()]
    if missing:
        return missing
    with (out / "design_runs.csv").open(encoding="utf-8", newline="") as file:
        failed = sum(row.get("status", "ok") not in ("ok", "") for row in csv.DictReader(file))
    told = json.loads((out / "summary.json").read_text(encoding="utf-8")).get("failures", [])
    return [f"{max(failed, len(told))} runs failed"] * (failed > 0 or bool(told))


def main(arguments: Sequence[str] | None = None) -> int:
    """Walk the paths and print the table."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("paths", nargs="*", metavar="PATH", help=", ".join(PATHS))
    parser.add_argument("--out", type=Path, help="keep the folder")
    options = parser.parse_args(arguments)
    if unknown := [path for path in options.paths if path not in PATHS]:
        parser.error(f"no path {', '.join(unknown)}; choose of {', '.join(PATHS)}")
    chosen = list(dict.fromkeys([BASIS, *(options.paths or PATHS)]))
    with tempfile.TemporaryDirectory() as temporary:
        steps = []
        print("| path | step | exit | wall [s] | processor [s] |\n|---|---|---|---|---|")
        for path in chosen:
            for step in walk(path, (options.out or Path(temporary)).resolve() / path):
                steps.append(step)
                remark = f"; **{'; '.join(step.faults)}**" if step.faults else ""
                command = step.command.split(" --")[0].replace("{examples}/", "")
                print(
                    f"| {path} | `{command}` | {step.code}{remark} | {step.wall:.1f} | {step.processor:.1f} |",
                    flush=True,
                )
    spent = {path: sum(step.processor for step in steps if step.path == path) for path in chosen}
    print("\nProcessor time over that of the example study:")
    print(", ".join(f"{path} {spent[path] / spent[BASIS]:.1f}" for path in chosen[1:]))
    return int(any(step.faults for step in steps))


if __name__ == "__main__":
    sys.exit(main())
