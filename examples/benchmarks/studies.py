"""What the studies of this folder share: a command line, tables and files, and figures of a process of its own.

A study is a function ``study(scene, progress) -> rbdyn.accuracy.Report``; ``main`` runs it on a scene, prints its tables and
conclusions and, with ``--out DIR``, writes its record, sheets and pictures.
"""

import argparse
import inspect
import json
import os
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from rbdyn.accuracy.report import Report

EXAMPLES = Path(__file__).parents[1]


def main(study: "Callable[..., Report]", about: str, scene: str = "cylindrical_roller.toml", **counts: int) -> int:
    """Run a study from the command line; returns its exit code: 0, 1 where it fails, 2 for bad input.

    ``about`` is its help; ``scene``: the shipped one that it takes unless another is named; ``counts``: whole numbers that
    are options of their own, with their defaults.
    """
    from rbdyn import Scene, accuracy
    from rbdyn.base.command import progress_bar
    from rbdyn.base.faults import InputError, RunError

    parser = argparse.ArgumentParser(description=about, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("scene", nargs="?", type=Path, default=EXAMPLES / scene, help=f"scene, {scene} unless named")
    parser.add_argument(
        "--set", action="append", default=[], metavar="KEY.PATH=VALUE", help="replace a key; repeatable"
    )
    parser.add_argument("--out", type=Path, metavar="DIR", help="write the record, the sheets and the pictures here")
    for name, count in counts.items():
        parser.add_argument(f"--{name}", type=int, default=count, metavar="N", help=f"{count} unless given")
    given = parser.parse_args()
    try:
        loaded = Scene.load(given.scene, given.set)
        with progress_bar(Path(sys.argv[0]).stem, False) as progress:
            report = study(loaded, progress, **{name: getattr(given, name) for name in counts})
    except (InputError, RunError) as error:
        print(error, file=sys.stderr)
        return 2 if isinstance(error, InputError) else 1
    accuracy.show(report)
    if given.out is not None:
        given.out.mkdir(parents=True, exist_ok=True)
        print(f"written to {given.out}: {', '.join(accuracy.write(report, given.out))}")
    return int(report.failed)


def printed(function: Callable[[], None], data: Any, fault: str, **environment: str) -> str:
    """What a function of a script of this folder prints in a fresh interpreter that is given ``data`` as JSON on standard
    input.

    Raises RunError, which begins with ``fault``, where that interpreter fails.
    """
    from rbdyn.base.faults import RunError

    name, file = function.__name__, Path(inspect.getfile(function))
    path = os.pathsep.join((str(file.parent), *filter(None, [os.environ.get("PYTHONPATH")])))
    run = subprocess.run(
        [sys.executable, "-c", f"from {file.stem} import {name}; {name}()"],
        input=json.dumps(data),
        env={**os.environ, "PYTHONPATH": path, **environment},
        capture_output=True,
        text=True,
        check=False,
    )
    if run.returncode != 0:
        raise RunError(f"{fault}: {next(reversed(run.stderr.strip().splitlines()), 'no reason given')}")
    return run.stdout
