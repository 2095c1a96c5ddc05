"""That something is compiled is said once, while it is, on standard error; quietly not."""

import json
import os
import subprocess
import sys
from pathlib import Path

import pytest

BALLS = Path(__file__).parents[2] / "examples" / "deep_groove_ball.toml"


@pytest.mark.parametrize(("option", "said"), [("--json", 1), ("-q", 0)])
def test_compiling_is_said_once(tmp_path, option, said):
    """With an empty folder of compiled code; standard output is one object with --json."""
    command = [sys.executable, "-m", "rbdyn", "ball", str(BALLS), option]
    environment = os.environ | {"NUMBA_CACHE_DIR": str(tmp_path)}
    shown = subprocess.run(command, env=environment, capture_output=True, text=True, timeout=300, check=True)
    assert shown.stderr.count("Compiling ...") == said and "Compiling" not in shown.stdout
    assert option == "-q" or json.loads(shown.stdout)["status"] == "ok"
