"""Time and peak memory of the commands against the size of what they are given.

``python examples/benchmarks/growth.py`` runs each command at rising sizes in processes of their own, until one takes more
than 10 s or 2 GiB, and fits over the last decade how time and memory beyond those of the smallest size grow: exponent 1 is
linear. It ends with what grows faster than that, the worst first, each with the size at which a bound is met: measured, or
foreseen by the exponent. ``--only WORD,...`` chooses commands whose name holds a word; ``--out FILE`` writes a table as CSV.

A command that refuses a size shows its sentence, and that is a good end. Sizes are rows, columns or factors of tables,
replicates, keys, links or points; the tables are random, with a fixed seed. The parent loads the standard library alone, for
a child's peak memory counts that of its parent at the fork.
"""

import argparse
import csv
import json
import math
import os
import random
import resource
import subprocess
import sys
import tempfile
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from typing import NamedTuple

EXAMPLES = Path(__file__).resolve().parents[1]
SCENE = EXAMPLES / "cylindrical_roller.toml"
LIMIT_S, LIMIT_MIB = 10.0, 2048.0
# A run is stopped after so many times the limit, and gets no more memory than so many times its limit.
STOP, ROOM = 6, 2
# What a size adds below this [s, MiB] is no growth but noise; exponents above the last one are faster than linear.
NOISE_S, NOISE_MIB, LINEAR = 0.5, 32.0, 1.2
DECADES = (100, 300, 1000, 3000, 10_000, 30_000, 100_000, 300_000, 1_000_000)
SHORT = "turns=2,discard_turns=1,impact_window_turns=1,extend=false,companion=false"
SET = [part for each in SHORT.split(",") for part in ("--set", f"numerics.{each}")]
DOE, RBDYN = [sys.executable, "-m", "doe"], [sys.executable, "-m", "rbdyn"]


class Measured(NamedTuple):
    """One run: its size, processor time [s], peak memory [MiB] and how it ended ("ok", a sentence, or "stopped")."""

    size: int
    seconds: float
    mib: float
    end: str


class Case(NamedTuple):
    """What grows, at which sizes, and the command that a size makes in a folder."""

    name: str
    sizes: Sequence[int]
    command: Callable[[int, Path], list[str]]


def table(path: Path, rows: int, factors: int = 2, responses: int = 1, repeats: int = 1, more: str = "") -> Path:
    """A table of runs on a quadratic surface with noise, each point ``repeats`` times; ``more``: "blocks" or "errors"."""
    draw = random.Random(1)
    names = [f"x{place}" for place in range(factors)] + [f"y{place}" for place in range(responses)]
    names += ["block"] * (more == "blocks") + ["y0_error", "replicates"] * (more == "errors")
    with path.open("w", encoding="utf-8", newline="") as file:
        writer = csv.writer(file)
        writer.writerow(names)
        for row in range(rows):
            if row % repeats == 0:
                point = [draw.uniform(-1.0, 1.0) for _ in range(factors)]
            bowl = 10.0 + sum(x + x * x for x in point)
            values = [bowl + (place % 3) * point[0] + 0.1 * draw.gauss(0.0, 1.0) for place in range(responses)]
            extra = [1 + row % max(rows // 10, 1)] * (more == "blocks") + [0.2, 8] * (more == "errors")
            writer.writerow([*point, *values, *extra])
    return path


def study(
    folder: Path, factors: int = 2, responses: int = 2, design: str = "", front: str = "generations = 50"
) -> Path:
    """A study without a scene, whose runs are a table's."""
    parts = [f'[[factor]]\nname = "x{place}"\ncentre = 0.0\nstep = 1.0\n' for place in range(factors)]
    goals = [f'[[response]]\nname = "y{place}"\ngoal = "{("min", "max")[place % 2]}"\n' for place in range(responses)]
    path = folder / "study.toml"
    path.write_text("\n".join([*parts, *goals, f"[design]\n{design}", f"[front]\n{front}\n"]), "utf-8")
    return path


def fit_rows(repeats: int = 1, more: str = "") -> Callable[[int, Path], list[str]]:
    """``doe fit`` of a table by its rows."""
    return lambda size, folder: [*DOE, "fit", "-q", "--response", "y0", "--factor", "x0", "--factor", "x1", "--data",
                                 str(table(folder / "t.csv", size, repeats=repeats, more=more))]  # fmt: skip


def fit_columns(size: int, folder: Path) -> list[str]:
    """``doe fit`` of a table by its responses."""
    path = table(folder / "t.csv", 30, responses=size)
    return [*DOE, "fit", "-q", "--factor", "x0", "--factor", "x1", "--data", str(path)]


def fit_factors(size: int, folder: Path) -> list[str]:
    """``doe fit`` of 300 rows by their factors."""
    path = table(folder / "t.csv", 300, factors=size)
    return [*DOE, "fit", "-q", "--response", "y0", "--data", str(path)]


def design(text: str) -> Callable[[int, Path], list[str]]:
    """``doe design`` by its factors."""
    return lambda size, folder: [*DOE, "design", "-q", str(study(folder, factors=size, design=text))]


def runs_of(kind: str) -> Callable[[int, Path], list[str]]:
    """``doe design`` by its runs."""
    return lambda size, folder: [*DOE, "design", "-q", str(study(folder, 3, design=f'kind = "{kind}"\nruns = {size}'))]


def front(
    rows: int = 60, responses: int = 2, text: str = "population = {}\ngenerations = 10"
) -> Callable[[int, Path], list[str]]:
    """``doe front`` by a key of [front]; without one in ``text``, by the rows of its table."""
    return lambda size, folder: [
        *DOE, "front", "-q", str(study(folder, responses=responses, front=text.format(size))), "--data",
        str(table(folder / "t.csv", rows if "{}" in text else size, responses=responses)),
    ]  # fmt: skip


def front_responses(size: int, folder: Path) -> list[str]:
    """``doe front`` by its responses."""
    return front(responses=size, text="generations = 20")(60, folder)


def simulate(key: str) -> Callable[[int, Path], list[str]]:
    """``rbdyn simulate`` of short motions by a key."""
    return lambda size, folder: [*RBDYN, "simulate", str(SCENE), "-q", *SET, "--set", f"numerics.{key}={size}"]


def chain_links(size: int, folder: Path) -> list[str]:
    """``doe chain`` by its links."""
    head = "[closing_link]\nlower_mm = -1.0\nupper_mm = 1.0\n"
    link = '[[link]]\nname = "l{0}"\ncoefficient = {1}\nnominal_mm = 10.0\nlower_mm = -0.0001\nupper_mm = 0.0001\n'
    (folder / "chain.toml").write_text(head + "".join(link.format(n, (-1) ** n) for n in range(size)), "utf-8")
    return [*DOE, "chain", str(folder / "chain.toml")]


def uncertain_keys(size: int, folder: Path) -> list[str]:
    """``doe uncertainty`` of 16 input sets by the keys that vary."""
    keys = json.loads(subprocess.run([*RBDYN, "keys", "--schema"], capture_output=True, text=True).stdout or "{}")
    tables = keys.get("$defs", {})
    numbers = [
        f"model.{name}" for name, key in tables.get("Model", {}).get("properties", {}).items()
        if isinstance(key.get("default"), float) and key["default"] > 0.0
    ]  # fmt: skip
    laws = "".join(
        f'"{key}" = {{ law = "uniform", low = 0.99, high = 1.01, times = "{key}" }}\n' for key in numbers[:size]
    )
    (folder / "scene.toml").write_text(SCENE.read_text("utf-8") + f'\n[uncertain]\ndefaults = "none"\n{laws}', "utf-8")
    return [
        *DOE,
        "uncertainty",
        str(folder / "scene.toml"),
        "--points",
        "16",
        "-q",
        *SET,
        "--out",
        str(folder / f"o{size}"),
    ]


def python(code: str, *arguments: object) -> list[str]:
    """A piece of code of its own; ``faults`` lets a fault of the input end as a command's does."""
    head = "import sys\nfrom pathlib import Path\nfrom rbdyn.base.command import guarded\n"
    return [sys.executable, "-c", f"{head}with guarded(False):\n    {code}", *map(str, arguments)]


def rig(rows: int, columns: int, folder: Path) -> list[str]:
    """Reading a rig's table, in which ``columns`` further ones are named after keys of a scene."""
    names = [f"operation.key{place}" for place in range(columns)]
    lines = (f"{12000 + row % 7},40,4{',1' * columns}" for row in range(rows))
    header = ",".join(["operation.inner_speed_rpm", "impact_force_N", "impact_force_N_sd", *names])
    (folder / "rig.csv").write_text("\n".join([header, *lines]), "utf-8")
    return python(
        "from doe.workflow.rig import read_rig; len(read_rig(Path(sys.argv[1])).conditions)", folder / "rig.csv"
    )


CASES = (
    Case("fit: rows", DECADES, fit_rows()),
    Case("fit: rows, each twice", DECADES, fit_rows(repeats=2)),
    Case("fit: rows with errors, each twice", DECADES, fit_rows(2, "errors")),
    Case("fit: rows in blocks of 10", DECADES, fit_rows(more="blocks")),
    Case("fit: responses", (1, 3, 10, 30, 100, 300), fit_columns),
    Case("fit: factors", (2, 3, 4, 5, 6, 7, 8, 9, 12), fit_factors),
    Case("front: rows", DECADES, front(text="generations = 50")),
    Case("front: responses", (2, 3, 4, 6, 8, 12, 16), front_responses),
    Case("front: population", (30, 100, 300, 1000, 3000, 10_000), front()),
    Case("front: generations", (30, 100, 300, 1000, 3000), front(text="population = 50\ngenerations = {}")),
    Case("front: draws", (100, 1000, 10_000, 100_000), front(text="generations = 20\ndraws = {}")),
    Case("design: factors, central composite", range(2, 13), design('kind = "central_composite"')),
    Case("design: factors, Box-Behnken", range(3, 13), design('kind = "box_behnken"')),
    Case("design: factors, full factorial", range(2, 13), design('kind = "full_factorial"')),
    Case("design: factors, D-optimal", range(2, 13), design('kind = "d_optimal"\nruns = 60')),
    Case("design: factors, I-optimal", range(2, 13), design('kind = "i_optimal"\nruns = 60')),
    Case("design: runs, D-optimal", (12, 30, 100, 300, 1000, 3000, 10_000), runs_of("d_optimal")),
    Case("design: runs, Latin hypercube", (30, 100, 300, 1000, 3000, 10_000), runs_of("latin_hypercube")),
    Case("design: runs, Sobol", (30, 100, 300, 1000, 3000, 10_000), runs_of("sobol")),
    Case("simulate: replicates", (10, 30, 100, 300, 1000, 3000), simulate("replicates")),
    Case("simulate: turns", (10, 30, 100, 300, 1000, 3000), simulate("turns")),
    Case("chain: links", (4, 10, 30, 100, 300, 1000), chain_links),
    Case("uncertainty: keys", (2, 4, 8, 16, 30), uncertain_keys),
    Case("rig: rows", DECADES, lambda size, folder: rig(size, 0, folder)),
    Case("rig: columns", (10, 30, 100, 300, 1000, 3000, 10_000, 30_000), lambda size, folder: rig(5, size, folder)),
)


def measured(size: int, command: list[str]) -> Measured:
    """Run a command with a bound on its time and its memory."""
    room = int(4096 + ROOM * LIMIT_MIB) << 20  # threads and machine code take addresses, not memory
    bounds = {resource.RLIMIT_AS: room, resource.RLIMIT_CPU: int(STOP * LIMIT_S)}

    def bounded() -> None:
        for kind, most in bounds.items():
            resource.setrlimit(kind, (most, most))

    with tempfile.TemporaryFile("w+") as errors:
        process = subprocess.Popen(
            command, stdout=subprocess.DEVNULL, stderr=errors, env={**os.environ, "PYTHONPATH": str(EXAMPLES.parent)},
            preexec_fn=bounded,
        )  # fmt: skip
        _, status, usage = os.wait4(process.pid, 0)
        errors.seek(0)
        lines = errors.read().splitlines()
    process.returncode = os.waitstatus_to_exitcode(status)
    end = "stopped" if process.returncode < 0 else "ok" if not process.returncode else (lines or ["no sentence"])[-1]
    return Measured(size, usage.ru_utime + usage.ru_stime, usage.ru_maxrss / 1024.0, end)


def runs(case: Case) -> Iterator[Measured]:
    """A run a size, until one takes more than a limit or is refused."""
    for size in case.sizes:
        with tempfile.TemporaryDirectory() as folder:
            one = measured(size, case.command(size, Path(folder)))
        print(
            f"{case.name:36} {size:8d} {one.seconds:8.2f} s {one.mib:7.0f} MiB  {'' if one.end == 'ok' else one.end}",
            flush=True,
        )
        yield one
        if one.end != "ok" or one.seconds > LIMIT_S or one.mib > LIMIT_MIB:
            return


def growth(
    sizes: Sequence[float], values: Sequence[float], noise: float, limit: float
) -> tuple[float | None, float | None]:
    """Exponent of what is beyond the first value over the last decade, and the size at which ``limit`` is met; None where
    nothing but noise is beyond it, or where the limit was not met and growth is linear at most."""
    beyond = [(size, value - values[0]) for size, value in zip(sizes, values, strict=True) if value - values[0] > noise]
    last = [(math.log(size), math.log(value)) for size, value in beyond if size >= beyond[-1][0] / 10.1]
    if len(last) < 2:
        return None, None
    mean = [sum(each) / len(last) for each in zip(*last, strict=True)]
    slope = sum((x - mean[0]) * (y - mean[1]) for x, y in last) / sum((x - mean[0]) ** 2 for x, _ in last)
    if slope <= LINEAR and values[-1] <= limit:
        return slope, None
    return slope, beyond[-1][0] * (max(limit - values[0], noise) / beyond[-1][1]) ** (1.0 / slope)


def main() -> None:
    """Read the arguments, measure, and say what grows faster than linear."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--only", default="", help="words of the cases to measure, such as fit,rig (all)")
    parser.add_argument("--out", type=Path, help="CSV file of all that was measured")
    asked = parser.parse_args()
    words = [word for word in asked.only.split(",") if word]
    rows, fast = [], []
    for case in (case for case in CASES if not words or any(word in case.name for word in words)):
        series = list(runs(case))
        rows += [(case.name, *one) for one in series]
        done = [one for one in series if one.end in ("ok", "stopped")]
        for what, values, noise, limit, unit in (
            ("time", [one.seconds for one in done], NOISE_S, LIMIT_S, "10 s"),
            ("memory", [one.mib for one in done], NOISE_MIB, LIMIT_MIB, "2 GiB"),
        ):
            exponent, bound = growth([one.size for one in done], values, noise, limit)
            if exponent is not None and exponent > LINEAR:
                fast.append(
                    (bound or math.inf, f"{case.name}: {what} grows as size^{exponent:.2f}, {unit} at {bound:.3g}")
                )
    if asked.out:
        with asked.out.open("w", encoding="utf-8", newline="") as file:
            csv.writer(file).writerows([("case", *Measured._fields), *rows])
    print("\n".join(sentence for _, sentence in sorted(fast)) or "nothing grows faster than linear")


if __name__ == "__main__":
    main()
