"""Streams that close, fill up or know only ASCII, and Ctrl-C: both commands, in processes of their own.

What Python makes of its streams as it starts is tried once for each kind of end, by a command that loads little; all other
commands run in children of this process.
"""

import json
import os
import re
import shlex
import signal
import subprocess
import sys
import time

import pytest
from conftest import EXAMPLE, ROOT
from forked import forked
from in_process import in_process
from short_studies import short_study

from rbdyn.accuracy import coverage

EXAMPLES = ROOT / "examples"
BALL = f"rbdyn ball {EXAMPLES}/angular_contact_ball.toml"
# Its front is short: ``BRIEF`` is the example's study, which the fixture ``brief`` puts where $BRIEF says.
BRIEF = "$BRIEF/study.toml"
STUDY = f"{BRIEF} --data {EXAMPLES}/ccd_table4.csv"
CHAIN = f"doe chain {EXAMPLES}/pocket_chain.toml"
COMMANDS = [
    "rbdyn --help",
    "rbdyn simulate --help",
    "doe study --help",
    BALL,
    f"{BALL} --preload 10:500:300",
    f"{BALL} --sweep operation.inner_speed_rpm=1000:2000:3",
    f"{CHAIN} -v",
    f"{CHAIN} --json",
    f"doe design {EXAMPLES}/clearance_study.toml -v",
    f"doe design {EXAMPLES}/clearance_study.toml --csv",
    f"doe fit {STUDY} -v",
    f"doe front {STUDY} -v",
]
RUN = (
    f"rbdyn simulate {EXAMPLE} --turns 2 --replicates 1 --set numerics.discard_turns=1 --set numerics.companion=false "
    "--set numerics.extend=false -v"
)
SIMULATED = [
    RUN,
    f"rbdyn map {EXAMPLE} --speed 20000 --load 900 --turns 2 --replicates 1 --set numerics.companion=false",
    f"rbdyn accuracy {EXAMPLE} coverage --set numerics.turns=1 --set numerics.discard_turns=1 "
    "--set numerics.replicates=2 --set numerics.extend=false --set numerics.companion=false",
]
HELP = ["rbdyn --help", "doe study --help"]
# What is closed of the streams, or how many lines are read, and how a shell says so.
ENDS = {"| true": {"lines": 0}, ">&-": {"closed": [1]}, "2>&-": {"closed": [2]}, "<&- >&- 2>&-": {"closed": [0, 1, 2]}}


@pytest.fixture(scope="module", autouse=True)
def brief(tmp_path_factory):
    """The example's study with a short front, in the folder $BRIEF."""
    folder = tmp_path_factory.mktemp("brief")
    short_study(folder)
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("BRIEF", str(folder))
        patch.setattr("doe.workflow.surfaces.MOST_RIVALLED", 0)
        patch.setattr(coverage, "REPEATS", 2)
        patch.setattr(coverage, "TRUTH_REPLICATES", 2)
        # What commands load and compile is loaded here once, not in each child.
        for line in (BALL, *COMMANDS[-2:], RUN):
            assert in_process(*shlex.split(os.path.expandvars(line))).returncode == 0
        yield


def shell(line, **environment):
    """Run a line of bash in which ``rbdyn`` and ``doe`` are this checkout's; the code of a pipe is its command's."""
    functions = "".join(f'{name}() {{ {shlex.quote(sys.executable)} -m {name} "$@"; }}\n' for name in ("rbdyn", "doe"))
    script = f"set -o pipefail\n{functions}{line}"
    variables = {**os.environ, "PYTHONPATH": str(ROOT), **environment}
    return subprocess.run(["bash", "-c", script], capture_output=True, text=True, env=variables, check=False)


@pytest.mark.parametrize(("line", "end"), [*((HELP[0], end) for end in ENDS), (HELP[1], [*ENDS][-1])])
def test_a_shell_closes_a_stream_of_a_new_interpreter(line, end):
    """Command line: | true, >&- and 2>&- as a shell makes them."""
    found = shell(f"{line} {end}")
    assert (found.returncode, found.stderr) == (0, "")


@pytest.mark.parametrize(("line", "end"), list(zip(COMMANDS, 3 * [*ENDS], strict=True)))
def test_a_reader_that_goes_or_a_closed_stream_changes_no_exit_code(line, end):
    """Command line: | true, >&- and 2>&- end as usual and without a word."""
    found = forked(line, **ENDS[end])
    assert (found.returncode, found.stderr) == (0, "")


@pytest.mark.parametrize(
    ("start", "line"), [(shell, HELP[0]), *((forked, line) for line in [*COMMANDS[::3], *SIMULATED])]
)
def test_a_full_device_is_told_in_one_sentence(monkeypatch, start, line):
    """Command line: > /dev/full is exit code 1 and one sentence."""
    monkeypatch.setattr(coverage, "TRUTH_REPLICATES", 2)  # in place of 64
    found = shell(f"{line} > /dev/full") if start is shell else forked(line, output="/dev/full")
    assert found.returncode == 1
    assert faults(found.stderr) == "standard output: No space left on device; free space or write elsewhere\n"


def test_tables_are_written_where_python_starts_with_ascii():
    """Command line: in the locale C tables come in ASCII, "±" as "+-"."""
    for more in ({"PYTHONUTF8": "0"}, {"PYTHONIOENCODING": "ascii"}):
        found = shell(f"{CHAIN} -v", LC_ALL="C", **more)
        assert (found.returncode, found.stderr) == (0, "")
        assert found.stdout.isascii() and "?" not in found.stdout


@pytest.mark.parametrize("line", [f"{CHAIN} -v", f"doe fit {STUDY} -v", f"doe front {STUDY} -v", RUN])
def test_tables_are_written_where_only_ascii_goes(line):
    """Command line: every table, in ASCII."""
    found = forked(line, encoding="ascii")
    assert (found.returncode, faults(found.stderr)) == (0, "")
    assert found.stdout.isascii() and "?" not in found.stdout


@pytest.mark.parametrize(
    ("line", "files"),
    [
        (f"{BALL} --preload 10:500:300", {"preload.json"}),
        (RUN, {"result.json", "history.csv", "cage_orbit.png", "pocket_forces.png"}),
        (f"doe front {STUDY} -v", {"front.json"}),
        (CHAIN, {"chain.json"}),
    ],
)
def test_files_stand_whole_where_the_pipe_is_closed_early(line, files, tmp_path):
    """Command line: --out writes what it writes without a pipe, whoever reads."""
    found = forked(f"{line} --out {tmp_path}", lines=3)
    assert (found.returncode, faults(found.stderr)) == (0, "")
    assert files <= {path.name for path in tmp_path.iterdir()} - {"made_by.json"}
    assert all(json.loads(path.read_text()) for path in tmp_path.glob("*.json"))


def test_a_closed_error_stream_leaves_standard_output_to_json():
    """Command line: sentences do not fall into standard output where standard error is closed."""
    silent = shell("doe chain none.toml 2>&-")
    assert (silent.returncode, silent.stdout) == (2, "")
    assert json.loads(forked("doe chain none.toml --json", closed=[2]).stdout)["status"] == "refused"


@pytest.mark.parametrize("line", ["rbdyn --help", f"doe front {STUDY}", RUN])
def test_ctrl_c_leaves_with_130_and_no_traceback(line):
    """Command line: an interrupt at any time from the first import on; what had ended by then ended as usual."""
    name, *arguments = shlex.split(os.path.expandvars(line))
    # Its first line tells that Python itself is up.
    program = f"import {name}, rbdyn.base.loading; print(flush=True); from {name}.cli import run; run()"
    codes = set()
    for delay in (0.05, 0.1, 0.2, 0.4, 1.0):
        process = subprocess.Popen(
            [sys.executable, "-c", program, *arguments],
            stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, env={**os.environ, "PYTHONPATH": str(ROOT)},
            preexec_fn=lambda: signal.signal(signal.SIGINT, signal.default_int_handler),
        )  # fmt: skip
        assert process.stdout.readline() == "\n"
        time.sleep(delay)
        process.send_signal(signal.SIGINT)
        _, told = process.communicate(timeout=60)
        codes.add(process.returncode)
        assert faults(told) in ("", "interrupted; nothing was saved\n")
    assert 130 in codes and codes <= {0, 130}


def test_an_interrupt_in_the_making_of_a_class_is_one_too():
    """Unit: Python 3.11 wraps what is raised while a class names its fields in a RuntimeError; no traceback of it is shown."""
    program = (
        "from rbdyn.base.streams import run\n"
        "class Field:\n    def __set_name__(self, owner, name):\n        raise KeyboardInterrupt\n"
        "def app():\n    type('Table', (), {'field': Field()})\n"
        "run(app)"
    )
    ended = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, cwd=ROOT)
    assert (ended.returncode, ended.stderr) == (130, "")


def test_an_interrupt_that_a_callback_swallows_comes_again():
    """Unit: Ctrl-C inside a callback from compiled code, where nothing can be raised, ends the command all the same."""
    program = (
        "import ctypes, signal, sys, time\nfrom rbdyn.base.streams import run\n"
        "signal.signal(signal.SIGINT, signal.default_int_handler)\nkind = ctypes.CFUNCTYPE(None)\n"
        "swallowing = kind(lambda: signal.raise_signal(signal.SIGINT))\n"
        "def app():\n    swallowing()\n    time.sleep(600)\n"
        "run(app)"
    )
    found = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=False, timeout=300)
    assert (found.returncode, found.stderr) == (130, "")


@pytest.mark.parametrize("package", ["rbdyn", "doe"])
def test_an_interrupt_that_compiled_code_prints_and_loses_stays_silent(package):
    """Command line: Cython prints a Ctrl-C that it cannot raise; neither our programs nor typer show it."""
    program = (
        f"import importlib\ncli = importlib.import_module('{package}.cli')\n"
        "import sys, typer.core\n"
        "usual = typer.core.TyperGroup.main\n"
        "def main(self, *a, **k):\n"
        "    sys.excepthook(KeyboardInterrupt, KeyboardInterrupt(), None)\n"
        "    return usual(self, *a, **k)\n"
        "typer.core.TyperGroup.main = main\nsys.argv = ['x', '--help']\ncli.run()"
    )
    found = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=False, timeout=300)
    assert (found.returncode, found.stderr) == (0, "")


def test_an_interrupt_that_pydantic_words_is_one():
    """Unit: Ctrl-C while a model is built, of which pydantic leaves the name in the text of its own error."""
    wrapped = "Error building `default` serializer:\\n  SchemaError: Error building `literal` serializer:\\n  KeyboardInterrupt: "
    program = f"from rbdyn.base.streams import run\ndef app():\n    raise ValueError('{wrapped}')\nrun(app)"
    found = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=False, timeout=300)
    assert (found.returncode, found.stderr) == (130, "")


def test_the_guard_loads_nothing_heavy():
    """Unit: what meets streams and interrupts stands before anything else is loaded."""
    program = "import sys, rbdyn.base.loading; print(*{'typing', 'enum', 'threading', 'numpy'} & {*sys.modules})"
    bare = "import sys; print(*{'typing', 'enum', 'threading', 'numpy'} & {*sys.modules})"
    loaded, before = (
        subprocess.run([sys.executable, "-I", "-S", "-c", f"import sys; sys.path.insert(0, {str(ROOT)!r}); {each}"],
                       capture_output=True, text=True, check=True).stdout
        for each in (program, bare)
    )  # fmt: skip
    assert loaded == before == "\n"


def test_a_warning_of_a_library_is_one_sentence_without_its_path():
    """Command line: numpy's overflow, three times, is said once, and no place in a library; -W shows it whole."""
    program = (
        "import warnings, numpy\nfrom rbdyn.base import streams\n"
        "def app():\n    for _ in range(3):\n        numpy.array([1e308]) * 10.0\n"
        "    warnings.warn('File \"/usr/lib/python3/site-packages/numba/x.py\", line 3', stacklevel=1)\n"
        "streams.run(app)\n"
    )
    found, whole = (
        subprocess.run([sys.executable, *more, "-c", program], capture_output=True, text=True, cwd=ROOT, check=False)
        for more in ((), ("-W", "default"))
    )
    first, second = found.stderr.splitlines()
    assert first == "warning: overflow encountered in multiply (RuntimeWarning); check the input for extreme numbers"
    assert found.returncode == 0 and "/" not in second and "<string>" in whole.stderr


def faults(said: str) -> str:
    """Standard error without the plan of runs and what is said while they go on."""
    plans = re.compile(
        r"note: \d+ runs? of .* at once|note: the rest takes .*|\d+ steps|the rest takes .*|Compiling .*"
    )
    return "".join(f"{line}\n" for line in said.splitlines() if not plans.fullmatch(line))
