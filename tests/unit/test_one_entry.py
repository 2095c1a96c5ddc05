"""A figure, a loss or a clearance that is added to its one list appears in everything that names them."""

import json
import subprocess
import sys
from pathlib import Path

import pytest

PROGRAM = Path(__file__).parents[1] / "helpers" / "with_entries.py"


@pytest.mark.parametrize("kind", ["figure", "loss", "clearance"])
def test_one_entry_appears_everywhere(kind, tmp_path):
    """One entry more in the text of a list: JSON, terminal, page, responses, limits, map, uncertainty, rig and manual have it."""
    done = subprocess.run([sys.executable, PROGRAM, kind, tmp_path], capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    found = json.loads(done.stdout)
    assert len(found) >= 4 and [place for place, has_it in found.items() if not has_it] == []
