"""That something is compiled is said once, while it is, on standard error; quietly not, nor by the next process."""

import json
import os
import shutil
import subprocess
import sys
from pathlib import Path

from in_process import in_process

from rbdyn.base.command import notice
from rbdyn.compiled.kernel import Compiling, cache_folder

BALLS = Path(__file__).parents[2] / "examples" / "deep_groove_ball.toml"


def test_compiling_is_said_once_and_kept_for_the_next_process(tmp_path):
    """With a folder of compiled code in which a small function is missing, and again with it; standard output is one object."""
    usual = cache_folder()
    assert usual is not None and in_process("rbdyn", "ball", BALLS).returncode == 0
    own = tmp_path / "rbdyn" / usual.name
    own.mkdir(parents=True)
    for path in (usual / "self-test-passed", *usual.glob("rbdyn.quasistatic*.nbc")):
        shutil.copy(path, own)
    command = [sys.executable, "-m", "rbdyn", "ball", str(BALLS), "--json"]
    environment = os.environ | {"NUMBA_CACHE_DIR": str(tmp_path)}
    for said in (1, 0):
        shown = subprocess.run(command, env=environment, capture_output=True, text=True, timeout=300, check=True)
        assert shown.stderr.count("Compiling ...") == said and "Compiling" not in shown.stdout
        assert json.loads(shown.stdout)["status"] == "ok"


def test_a_quiet_command_says_nothing_of_compiling(capsys):
    for quiet in (False, True):
        notice(quiet)
        Compiling().begin()
        assert capsys.readouterr().err.count("Compiling ...") == (not quiet)
