"""Which unknown input decides between pick and baseline, by seed of the input sets and number of pairs.

``python examples/benchmarks/decides.py STUDY.toml --out FOLDER`` judges the study over its unknown inputs with each seed and
size and prints a row each: probability that the pick is better in all responses, the deciding input with its flip and worth,
or that it is undecided. One input must not be named with one seed and another with the next. All share the runs in FOLDER:
fewer pairs are the first of more. ``--seeds 1,2,3`` and ``--pairs 128,256`` choose.
"""

import argparse
import json
import shutil
import subprocess
import sys
from pathlib import Path
from typing import Any

EXAMPLES = Path(__file__).resolve().parents[1]


def numbers(text: str) -> list[int]:
    return [int(each) for each in text.split(",")]


def study_of(path: Path, folder: Path, seed: int, pairs: int) -> Path:
    """A copy of a study without a judgement of its own, with this seed and size, beside copies of the files that it names."""
    for each in (*path.parent.glob("*.toml"), *path.parent.glob("*.csv")):
        shutil.copy(each, folder / each.name)
    text = path.read_text(encoding="utf-8")
    if "[robust]" in text or "[uncertain]" in text:
        raise SystemExit(f"{path}: has [robust] or [uncertain]; take them out, seeds and sizes are set here")
    copy = folder / path.name
    copy.write_text(f'{text}\n[robust]\npoints = {pairs}\nfront = "none"\n\n[uncertain]\nseed = {seed}\n', "utf-8")
    return copy


def judged(path: Path, folder: Path, seed: int, pairs: int) -> dict[str, Any]:
    """What the study says of its pick over the unknown inputs."""
    study = study_of(path, folder, seed, pairs)
    line = [sys.executable, "-m", "doe", "study", str(study), "--robust", "--json", "--out", str(folder / "results")]
    ended = subprocess.run(line, capture_output=True, text=True, check=False)
    if not ended.stdout:
        raise SystemExit(ended.stderr)
    robust: dict[str, Any] = json.loads(ended.stdout)["robust"]
    return robust


def row(seed: int, pairs: int, robust: dict[str, Any]) -> str:
    """One line of the table."""
    chance = "{:.0f} ({:.0f} to {:.0f})".format(*(100.0 * each for each in robust["all"]))
    return f"| {seed} | {pairs} | {chance} | {robust['sentences'][1]} |"


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("study", type=Path, nargs="?", default=EXAMPLES / "clearance_study.toml")
    parser.add_argument("--out", type=Path, required=True)
    parser.add_argument("--seeds", type=numbers, default=[1, 2, 3])
    parser.add_argument("--pairs", type=numbers, default=[128, 256])
    given = parser.parse_args()
    given.out.mkdir(parents=True, exist_ok=True)
    print("| seed | pairs | better in all, of 100 | what decides |\n| --- | --- | --- | --- |")
    firsts = set()
    for seed in given.seeds:
        for pairs in given.pairs:
            robust = judged(given.study.resolve(), given.out, seed, pairs)
            print(row(seed, pairs, robust), flush=True)
            firsts |= {each["key"] for each in robust["decides"][:1]}
    print(f"\nNamed as deciding: {', '.join(sorted(firsts)) or 'none'}.")


if __name__ == "__main__":
    main()
