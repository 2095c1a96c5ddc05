"""What the commands hand out on small runs: first screen, JSON object, tables and text of the page, kept case by case.

A folder of ``outputs`` holds a case. Long lists and tables stand there by their first and last entries and a digest of all.
Nothing that differs between two runs is in them: clocks stand still, dates and versions are masked.
"""

import contextlib
import csv
import hashlib
import importlib
import io
import json
import os
import re
import shutil
import tempfile
import threading
import time
from collections.abc import Callable, Iterator, Sequence
from html.parser import HTMLParser
from pathlib import Path
from typing import Any, NamedTuple
from unittest.mock import patch

HERE = Path(__file__).parent
FOLDER, EXAMPLES = HERE / "outputs", HERE.parents[1] / "examples"
TURNS = ("turns=2", "discard_turns=1", "replicates=2", "impact_window_turns=1", "companion=false", "extend=false")
SHORT = tuple(word for each in TURNS for word in ("--set", f"numerics.{each}"))
UNCERTAIN = f"""
[uncertain]
defaults = "none"
set = {json.dumps([f"numerics.{each}" for each in TURNS])}
"cage.mass_g" = {{ law = "normal", mean = 45.0, sd = 3.0 }}
"model.drag_coefficient" = {{ law = "log_uniform", low = 0.3, high = 1.2 }}
"""
ROBUST = """
[robust]
points = 32
settle = 0.0
front = "quantile"
"""
RIG = """operation.inner_speed_rpm,impact_force_N,impact_force_N_sd,power_loss_W,power_loss_W_sd
12000,40,1,40,1
18000,60,1,100,2
24000,80,2,180,3
"""
DUTY = """name,share,operation.inner_speed_rpm,operation.radial_load_N
idle,0.3,8000,500
cruise,0.7,24000,1300
"""
LONG, SHOWN = 6, 2  # lists and tables of more entries than LONG show SHOWN at either end
DATE = re.compile(r"\b20\d\d-\d\d-\d\d\b(?:[T ]\d\d:\d\d(?::\d\d)?)?")
NUMBER = re.compile(r"(?<![A-Za-z_])[-+−]?\d+(?:\.\d+)?(?:e[-+]?\d+)?")  # as text, whatever its sign
DIGEST = re.compile(r"(?<![\w.])(?=[a-f]*\d)[0-9a-f]{12,64}\b")
DURATION = re.compile(r"\btook [\d.]+ (s|min|h)\b")
MASKED = ("versions", "machine", "seconds")


class Output(NamedTuple):
    """A command on a small run: its words, what it asks for besides the example scenes, settings that make it brief."""

    words: tuple[str, ...]
    files: Callable[[Path], Any] = lambda folder: None
    settings: tuple[tuple[str, Any], ...] = ()
    slow: bool = False
    steady: bool = False  # other bits of a sum change no word


def study(folder: Path, addition: str = "") -> None:
    """A short study, and the table of published runs beside it."""
    from short_studies import short_study

    path = short_study(folder, ",".join(TURNS))
    path.write_text(path.read_text("utf-8") + addition, "utf-8")


def robust(folder: Path) -> None:
    """A short study that is judged over unknown inputs."""
    study(folder, ROBUST)
    unknown(folder)


def unknown(folder: Path) -> None:
    """The example with two unknown inputs, and a rig's table."""
    scene = folder / "cylindrical_roller.toml"
    scene.write_text((EXAMPLES / scene.name).read_text("utf-8") + UNCERTAIN, "utf-8")
    (folder / "rig.csv").write_text(RIG, "utf-8")


def duty(folder: Path) -> None:
    """Two points of a duty."""
    (folder / "duty.csv").write_text(DUTY, "utf-8")


ROLLER, TABLE = "cylindrical_roller.toml", ("study.toml", "--data", "ccd_table4.csv")
BRIEF_DECISION = (("doe.unknown.decision:RESAMPLES", 40), ("doe.unknown.decision:HALVES", 40))
BRIEF_ROBUST = (*BRIEF_DECISION, ("doe.workflow.robust:GENERATIONS", 15))
BRIEF_ACCURACY = (("rbdyn.accuracy.methods:SPANS", (0.25,)), ("rbdyn.accuracy.methods:REPEATS", 1))
OUTPUTS = {
    "simulate": Output(("rbdyn", "simulate", ROLLER, *SHORT)),
    "simulate_duty": Output(("rbdyn", "simulate", ROLLER, "--duty", "duty.csv", *SHORT), duty),
    "map": Output(("rbdyn", "map", ROLLER, "--speed", "15000,24000", "--load", "500", *SHORT)),
    "accuracy": Output(("rbdyn", "accuracy", ROLLER, *SHORT), settings=BRIEF_ACCURACY),
    "ball": Output(("rbdyn", "ball", "angular_contact_ball.toml"), steady=True),
    "design": Output(("doe", "design", "study.toml"), study, steady=True),
    "fit": Output(("doe", "fit", *TABLE, "--verbose"), study, steady=True),
    "front": Output(("doe", "front", *TABLE), study),
    "chain": Output(("doe", "chain", "bearing_chains.toml"), steady=True),
    "study": Output(("doe", "study", "study.toml", "--verbose"), study),
    "uncertainty": Output(("doe", "uncertainty", ROLLER, "--points", "16", "--target", "50%"), unknown, BRIEF_DECISION),
    "calibrate": Output(("doe", "calibrate", ROLLER, "--data", "rig.csv"), unknown, slow=True),
    "study_robust": Output(("doe", "study", "study.toml", "--verbose"), robust, BRIEF_ROBUST, slow=True),
    "study_adaptive": Output(("doe", "study", "study.toml", "--adaptive"), study, slow=True),
}  # fmt: skip


@contextlib.contextmanager
def still(settings: Sequence[tuple[str, Any]]) -> Iterator[None]:
    """Clocks that stand still, but for a millisecond a reading of processor time; no pictures; one thread of algebra."""
    from instant_runs import unillustrated
    from threadpoolctl import threadpool_limits

    readings = threading.local()

    def thread_time() -> float:
        readings.count = getattr(readings, "count", 0) + 1
        return readings.count / 1024

    def replaced(target: Any, name: str, value: Any) -> None:
        stack.enter_context(patch.object(target, name, value))

    with contextlib.ExitStack() as stack:
        stack.enter_context(threadpool_limits(1))
        unillustrated(replaced)
        replaced(time, "perf_counter", lambda: 0.0)
        replaced(time, "thread_time", thread_time)
        stack.enter_context(patch.dict(os.environ, {"COLUMNS": "160"}))
        for place, value in settings:
            module, name = place.split(":")
            replaced(importlib.import_module(module), name, value)
        yield


def handed_out(case: str) -> dict[str, str]:
    """The files of a case, here and now, by name."""
    from in_process import in_process

    output, before = OUTPUTS[case], Path.cwd()
    with tempfile.TemporaryDirectory() as name, still(output.settings):
        folder = Path(name)
        for each in (*EXAMPLES.glob("*.toml"), *EXAMPLES.glob("*.csv")):
            shutil.copy(each, folder)
        output.files(folder)
        os.chdir(folder)
        try:
            written, printed = (in_process(*output.words, "--out", "out", *more) for more in ((), ("--json",)))
        finally:
            os.chdir(before)
        screen, record = written.stdout, json.loads(printed.stdout)
        assert written.returncode == printed.returncode, printed.stderr
        files = sorted(path.name for path in (folder / "out").iterdir() if path.suffix != ".sqlite")
        found = {"screen.txt": words_of(screen), "record.json": lines_of(shortened(record))}
        found["files.txt"] = "\n".join([f"exit code {written.returncode}", *files]) + "\n"
        for path in sorted((folder / "out").glob("*.csv")):
            found[path.name] = table_of(path.read_text("utf-8"))
        for path in (folder / "out").glob("report.html"):
            found["page.txt"] = words_of(text_of_page(path.read_text("utf-8")))
    return found


def words_of(text: str) -> str:
    """Text without dates, durations, digests, versions, the name of the processor and spaces at the ends of lines."""
    from rbdyn.accuracy.report import processor
    from rbdyn.base.files import versions

    for version in (processor(), *versions().values()):
        text = text.replace(str(version), "*")
    return "\n".join(line.rstrip() for line in masked(text).splitlines()) + "\n"


def masked(text: str) -> str:
    """Text without what differs from run to run."""
    return DIGEST.sub("DIGEST", DURATION.sub("took TIME", DATE.sub("DATE", text)))


def digest_of(value: str) -> str:
    """A short name of all that is left out."""
    return hashlib.sha256(value.encode()).hexdigest()[:16]


def shortened(value: Any, key: str = "") -> Any:
    """A record with its long lists shortened and masked where runs differ."""
    if key in MASKED and value is not None:
        return "*"
    if isinstance(value, dict):
        return {name: shortened(each, name) for name, each in value.items()}
    if isinstance(value, list):
        rows = [shortened(each) for each in value]
        if len(rows) > LONG:
            rows[SHOWN:-SHOWN] = [f"{len(rows)} entries, digest {digest_of(json.dumps(rows))}"]
        return rows
    return masked(value) if isinstance(value, str) else value


def lines_of(record: Any) -> str:
    """JSON with a line for each value; lists of plain values in one."""

    def joined(found: re.Match[str]) -> str:
        return "[" + re.sub(r",\n\s+", ", ", found[1]) + "]"

    text = json.dumps(record, indent=1, ensure_ascii=False)
    return re.sub(r"\[\n\s+([^\[\]{}]*?)\n\s+\]", joined, text) + "\n"


def table_of(text: str) -> str:
    """A CSV table, shortened."""
    rows = words_of(text).splitlines()
    if len(rows) > LONG:
        rows[1 + SHOWN : -SHOWN] = [f"({len(rows) - 1} rows, digest {digest_of(text)})"]
    return "\n".join(rows) + "\n"


class Words(HTMLParser):
    """What a page says, without scripts, styles and drawings."""

    def __init__(self) -> None:
        super().__init__()
        self.found: list[str] = []
        self.silent = 0

    def handle_starttag(self, tag: str, attributes: Any) -> None:
        self.silent += tag in ("script", "style", "svg")

    def handle_endtag(self, tag: str) -> None:
        self.silent -= tag in ("script", "style", "svg")

    def handle_data(self, data: str) -> None:
        if not self.silent and data.strip():
            self.found.append(" ".join(data.split()))


def text_of_page(page: str) -> str:
    """The words of a page, a line for each piece."""
    words = Words()
    words.feed(page)
    return "\n".join(words.found)


def kept(case: str) -> dict[str, str]:
    """The files of a case as they are kept."""
    return {path.name: path.read_text("utf-8") for path in sorted((FOLDER / case).iterdir())}


def keep(case: str) -> None:
    """Write the files of a case anew."""
    found, place = handed_out(case), FOLDER / case
    shutil.rmtree(place, ignore_errors=True)
    place.mkdir(parents=True)
    for name, text in found.items():
        (place / name).write_text(text, "utf-8")


def keys_of(value: Any, depth: int, path: str = "") -> set[str]:
    """Paths of the keys within a record down to a depth."""
    if not isinstance(value, dict) or not depth:
        return {path}
    return {path}.union(*(keys_of(each, depth - 1, f"{path}.{key}") for key, each in value.items()))


def form_of(case: str, name: str, text: str) -> Any:
    """What of a file another platform must share, where motions part: upper keys of a record, header of a table; the words of
    a text that depends on no motion and no search."""
    if name == "record.json":
        return keys_of(json.loads(text), 1 + OUTPUTS[case].steady)
    if name.endswith(".csv"):
        return next(csv.reader(io.StringIO(text)))
    return NUMBER.sub("#", text).split() if OUTPUTS[case].steady or name == "files.txt" else None
