"""Long commands are killed at random moments, started again, and must end as if nothing had happened.

``python examples/benchmarks/interruptions.py --kills 10 --seed 1 --jobs 2`` disturbs ``rbdyn map``, ``doe uncertainty``,
``doe calibrate``, ``doe study --robust`` and ``doe study`` over a duty on the example bearing, each about half a minute long. Of
every ten kills about six are SIGKILL, two SIGTERM and two SIGINT (Ctrl-C), which comes one to three times, 30 to 120 ms apart;
``--signals INT`` draws that alone. With most runs done, every second one waits for a random result file to be written, so that
it meets the end of a command.

A command passes if, after all its kills, every CSV and JSON file equals that of an undisturbed run but for times; if no
run that had ended is made again (its row in the store keeps its dates, its line in a map's file its place); if exactly the
undisturbed runs are there; if SIGINT ends with exit code 130, and if no traceback is printed. The exit code is then 0.
"""

from __future__ import annotations

import argparse
import contextlib
import json
import random
import re
import shutil
import signal
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from doe.running.store import STORE, Store
from rbdyn.cli.app import MAP_POINTS as POINTS

EXAMPLES = Path(__file__).resolve().parents[1]
SHORT = (
    "numerics.turns=4", "numerics.discard_turns=2", "numerics.impact_window_turns=2", "numerics.replicates=2",
    "numerics.extend=false", "numerics.companion=false",
)  # fmt: skip
SIGNALS = "KILL,KILL,KILL,INT,TERM"
# Times and distances [s] of repeated Ctrl-C, and when a command that does not end after it counts as hanging [s].
TIMES, APART_S, HANGS_S = (1, 2, 3), (0.03, 0.12), 60.0
# Where so large a share of the runs is done, so large a share of the kills waits for a result file.
MOST_DONE, AT_FILES = 0.6, 0.5
# How often a folder is looked at for such a file [s].
LOOK_S = 0.002
UNCERTAIN = f"""
[uncertain]
defaults = "none"
points = 16
set = {json.dumps(SHORT)}
"model.pocket_bar_stiffness_N_m" = {{ law = "log_uniform", low = 1e7, high = 2e8 }}
"lubricant.oil_fraction" = {{ law = "log_uniform", low = 0.005, high = 0.1 }}
"""
DUTY = """
[[duty]]
name = "cruise"
share = 0.8
set = []
[[duty]]
name = "take-off"
share = 0.2
set = ["operation.radial_load_N=2000"]
"""
RIG = """operation.inner_speed_rpm,impact_force_N,impact_force_N_sd,power_loss_W,power_loss_W_sd
12000,40,4,40,4
18000,60,6,100,10
24000,80,8,180,18
"""


def inputs(folder: Path) -> None:
    """Write the scenes, the rig and the study that the commands read: the examples with short simulations."""
    for name in ("cylindrical_roller.toml", "ccd_table4.csv", "bearing_chains.toml"):
        shutil.copy(EXAMPLES / name, folder)
    scene = (EXAMPLES / "cylindrical_roller.toml").read_text("utf-8") + UNCERTAIN
    (folder / "uncertain.toml").write_text(scene, "utf-8")
    (folder / "rig_scene.toml").write_text(scene + "[calibrate]\nwaves = 1\n", "utf-8")
    (folder / "rig.csv").write_text(RIG, "utf-8")
    study = (EXAMPLES / "clearance_study.toml").read_text("utf-8").replace("replicates = 16", "replicates = 6")
    study = re.sub(r"(?m)^set = .*numerics\.turns=40.*$", f"set = {json.dumps(SHORT)}", study)
    study = study.replace("generations = 200", "generations = 20")
    (folder / "duty_study.toml").write_text(study + DUTY, "utf-8")
    robust = '[robust]\npoints = 32\nsettle = 0.0\nfront = "none"\n'
    (folder / "study.toml").write_text(study + UNCERTAIN + robust, "utf-8")


def commands(folder: Path) -> dict[str, list[str]]:
    """The commands by name, without their output folder."""
    short = [part for each in SHORT for part in ("--set", each)]
    ranges = ["--speed", "12000:24000:16", "--load", "500:3000:16", *short, "--turns", "20"]
    return {
        "rbdyn map": ["rbdyn", "map", str(folder / "cylindrical_roller.toml"), *ranges],
        "doe uncertainty": ["doe", "uncertainty", str(folder / "uncertain.toml"), "--points", "128", *short],
        "doe calibrate": ["doe", "calibrate", str(folder / "rig_scene.toml"), "--data", str(folder / "rig.csv")],
        "doe study --robust": ["doe", "study", str(folder / "study.toml"), "--robust"],
        "doe study, duty": ["doe", "study", str(folder / "duty_study.toml")],
    }


def started(command: list[str], out: Path, workers: int) -> subprocess.Popen[str]:
    """The command in a process of its own, which Ctrl-C meets as in a terminal."""
    line = [sys.executable, "-m", *command, "--out", str(out), "--workers", str(workers)]
    return subprocess.Popen(
        line, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True,
        preexec_fn=lambda: signal.signal(signal.SIGINT, signal.default_int_handler),
    )  # fmt: skip


def ended_runs(out: Path) -> dict[str, Any]:
    """What is finished in a folder: runs of its store by key, or the points of a map, each with what must not change."""
    if (out / POINTS).exists():
        lines = [line for line in (out / POINTS).read_text("utf-8").splitlines() if line.endswith("]")]
        keys = [json.loads(line.partition(" ")[2])[0] for line in lines]
        assert len(set(keys)) == len(keys), "a point of a map was run twice"
        return {key: (place, line) for place, (key, line) in enumerate(zip(keys, lines, strict=True))}
    if not (out / STORE).exists():
        return {}
    with Store(out / STORE, read_only=True) as store:
        return {run.key: run for run in store.ended()}


def written(path: Path) -> int:
    """When a file was last written [ns]; 0 where there is none."""
    try:
        return path.stat().st_mtime_ns
    except FileNotFoundError:
        return 0


def without_times(record: dict[str, Any]) -> dict[str, Any]:
    """A JSON record without the seconds of its cost, and without the digest of the record as a whole."""
    cost = {key: value for key, value in record.get("cost", {}).items() if not key.endswith("_s")}
    return {key: value for key, value in record.items() if key != "sha256"} | {"cost": cost}


def results(out: Path) -> dict[str, Any]:
    """Content of all CSV and JSON files by name, without times."""
    tables = {path.name: path.read_text("utf-8") for path in out.glob("*.csv")}
    records = {path.name: without_times(json.loads(path.read_text("utf-8"))) for path in out.glob("*.json")}
    # Digests of files that state times.
    records["made_by.json"]["files"] = sorted(records["made_by.json"]["files"])
    return tables | records


@dataclass
class Disturbed:
    """A command under test: an undisturbed run, and what its kills did."""

    name: str
    command: list[str]
    folder: Path
    workers: int
    kills: int
    draw: random.Random
    signals: list[signal.Signals]
    lines: list[str] = field(default_factory=list)
    faults: list[str] = field(default_factory=list)

    def say(self, sentence: str) -> None:
        """Print a line of this command at once."""
        self.lines.append(sentence)
        print(f"{self.name:19} {sentence}", flush=True)

    def judge(self, right: bool, fault: str) -> None:
        """Note a fault where something is not right."""
        if not right:
            self.faults.append(fault)
            self.say(f"FAULT: {fault}")

    def undisturbed(self) -> None:
        """Run once to compile, and once, measured, to compare with."""
        for place in ("compiled", "undisturbed"):
            begin = time.monotonic()
            process = started(self.command, self.folder / place, self.workers)
            _, errors = process.communicate()
            self.judge(process.returncode == 0, f"exit code {process.returncode} undisturbed: {errors[-300:]}")
        self.seconds = time.monotonic() - begin
        self.whole, self.runs = results(self.folder / place), ended_runs(self.folder / place)
        self.names = {path.name for path in (self.folder / place).iterdir()}
        self.say(f"undisturbed: {self.seconds:.1f} s, {len(self.runs)} runs, {len(self.whole)} files")

    def moment(self, process: subprocess.Popen[str], out: Path, ended: int) -> str:
        """Wait for a random moment or, with most runs ``ended``, for a random result file to be written; returns which."""
        if ended > MOST_DONE * len(self.runs) and self.draw.random() < AT_FILES:
            name = self.draw.choice(sorted(set(self.whole) - {"made_by.json"}))
            before = written(out / name)
            while process.poll() is None and written(out / name) == before:
                time.sleep(LOOK_S)
            return f"as {name} is written"
        seconds = self.draw.uniform(0.0, self.seconds)
        with contextlib.suppress(subprocess.TimeoutExpired):
            process.wait(seconds)
        return f"after {seconds:.2f} s"

    def kill(self, number: int, out: Path) -> bool:
        """Start or go on in ``out`` and kill; returns whether the command ended before that."""
        before, chosen = ended_runs(out), self.draw.choice(self.signals)
        process = started(self.command, out, self.workers)
        when = self.moment(process, out, len(before))
        missed = process.poll() is not None
        process.send_signal(chosen)
        for _ in range(self.draw.choice(TIMES) - 1 if chosen is signal.SIGINT else 0):
            time.sleep(self.draw.uniform(*APART_S))
            process.send_signal(chosen)
        try:
            _, errors = process.communicate(timeout=HANGS_S)
        except subprocess.TimeoutExpired:
            self.judge(False, f"hangs after {chosen.name} {when}")
            process.kill()
            _, errors = process.communicate()
        self.judge("cannot be used" not in errors, f"a store is blamed after {chosen.name}: {errors[-300:]}")
        code, after = process.returncode, ended_runs(out)
        allowed = {0} if missed else {0, 130 if chosen is signal.SIGINT else -chosen}
        self.judge(code in allowed, f"exit code {code} after {chosen.name}: {errors[-300:]}")
        self.judge("Traceback" not in errors, f"a traceback after {chosen.name}: {errors[-2000:]}")
        self.judge(all(after.get(key) == run for key, run in before.items()), "a finished run was lost or made again")
        if missed:
            return True
        self.say(f"kill {number}: {chosen.name} {when}, exit code {code}, {len(after)} of {len(self.runs)} runs kept")
        return code == 0

    def disturbed(self) -> None:
        """Kill as often as asked, going on in a folder until the command ends there, then in a new one."""
        number, chain = 0, 0
        while number < self.kills:
            out, chain, whole = self.folder / f"chain{chain}", chain + 1, False
            while number < self.kills and not whole:
                whole = self.kill(number + 1, out)
                number += not whole
            self.finish(out)
        self.say(f"{number} kills in {chain} folders: {len(self.faults)} faults")

    def finish(self, out: Path) -> None:
        """Let the command end undisturbed, and compare with what it is without a kill."""
        before = ended_runs(out)
        begin = time.monotonic()
        process = started(self.command, out, self.workers)
        _, errors = process.communicate()
        after = ended_runs(out)
        self.judge(process.returncode == 0, f"exit code {process.returncode} in the end: {errors[-300:]}")
        self.judge("Traceback" not in errors, f"a traceback in the end: {errors[-2000:]}")
        self.judge(all(after.get(key) == run for key, run in before.items()), "a finished run was lost or made again")
        self.judge(set(after) == set(self.runs), f"{len(after)} runs in the end, {len(self.runs)} undisturbed")
        files = results(out)
        other = sorted(name for name in {*files, *self.whole} if files.get(name) != self.whole.get(name))
        self.judge(not other, f"files that differ: {', '.join(other)}")
        strays = {path.name for path in out.iterdir()} - self.names
        self.judge(not strays, f"files that an undisturbed run does not leave: {', '.join(sorted(strays))}")
        made = f"{len(after) - len(before)} of {len(after)} runs"
        self.say(f"went on to the end: {time.monotonic() - begin:.1f} s, {made}, {len(files) - len(other)} files equal")


def chosen_commands(folder: Path, only: str) -> Iterator[tuple[str, list[str]]]:
    """Commands whose name holds one of the words."""
    words = [word for word in only.split(",") if word]
    return ((name, line) for name, line in commands(folder).items() if not words or any(word in name for word in words))


def main() -> None:
    """Read the arguments, disturb the commands, and leave with 1 where one failed."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--kills", type=int, default=10, help="kills of each command (10)")
    parser.add_argument("--seed", type=int, default=1, help="seed of signals and moments (1)")
    parser.add_argument("--jobs", type=int, default=1, help="commands that are disturbed at once (1)")
    parser.add_argument("--workers", type=int, default=2, help="threads of a command (2)")
    parser.add_argument("--signals", default=SIGNALS, help=f"signals to draw from ({SIGNALS})")
    parser.add_argument("--only", default="", help="words of the commands to disturb, such as map,calibrate (all)")
    asked = parser.parse_args()
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        inputs(folder)
        tests = [
            Disturbed(
                name,
                line,
                folder / name.replace(" ", "_"),
                asked.workers,
                asked.kills,
                random.Random(f"{asked.seed} {name}"),
                [signal.Signals[f"SIG{word}"] for word in asked.signals.split(",")],
            )
            for name, line in chosen_commands(folder, asked.only)
        ]
        with ThreadPoolExecutor(asked.jobs) as pool:
            list(pool.map(lambda test: (test.undisturbed(), test.disturbed()), tests))
    faults = sum(len(test.faults) for test in tests)
    print(f"{sum(test.kills for test in tests)} kills of {len(tests)} commands: {faults} faults")
    sys.exit(faults > 0)


if __name__ == "__main__":
    main()
