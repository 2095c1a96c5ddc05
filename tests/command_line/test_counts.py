"""Counts beyond memory: refused in one sentence before anything is made, or answered in bounded memory."""

import json
import resource
from pathlib import Path

import numpy as np
import pytest
from conftest import EXAMPLE, ROOT
from in_process import in_process

from doe.designs.design import replicate_groups

EXAMPLES = ROOT / "examples"
BALL = (f"{EXAMPLES}/angular_contact_ball.toml",)
GIGABYTE = 1 << 30


def command(program, *arguments):
    """Run ``rbdyn`` or ``doe`` with 2 GB more of address space than there is, so that a needless allocation cannot pass unseen."""
    pages = int(Path("/proc/self/statm").read_text().split()[0])
    usual = resource.getrlimit(resource.RLIMIT_AS)
    resource.setrlimit(resource.RLIMIT_AS, (pages * resource.getpagesize() + 2 * GIGABYTE, usual[1]))
    try:
        return in_process(program, *arguments)
    finally:
        resource.setrlimit(resource.RLIMIT_AS, usual)


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (("ball", *BALL, "--sweep", "operation.inner_speed_rpm=1:2:99999999999"), "99999999999 values are more than"),
        (("ball", *BALL, "--preload", "1:2:99999999999"), "--preload 1:2:99999999999: 99999999999 values are more"),
        (("ball", *BALL, "--preload", f"1:2:{'9' * 5000}"), "not a list of numbers"),
        (("map", EXAMPLE, "--speed", "1:2:99999999999", "--load", "1,2"), "--speed 1:2:99999999999: 99999999999"),
        (("map", EXAMPLE, "--speed", "1:2:9000", "--load", "1:2:9000"), "81000000 points are more than the 10000"),
        (("simulate", EXAMPLE, "--turns", "1e12", "--replicates", "10000"), "turns = 1000000000000.0: must be at"),
        (("simulate", EXAMPLE, "--turns", "1e6", "--replicates", "10000"), "numerics"),
    ],
)
def test_a_count_beyond_memory_is_refused(arguments, words):
    """Command line: exit code 2 and one sentence that names the field, the count and the bound."""
    found = command("rbdyn", *arguments)
    assert found.returncode == 2 and found.stdout == ""
    assert words in found.stderr
    assert len(found.stderr.splitlines()) == 1 or "Usage" in found.stderr


@pytest.mark.parametrize(("table", "bound"), [("monte_carlo", 100_000_000), ("selective", 10_000_000)])
def test_assemblies_beyond_memory_are_refused(table, bound, tmp_path):
    """Command line: a hundred billion assemblies are refused with the bound."""
    text = (EXAMPLES / "pocket_chain.toml").read_text(encoding="utf-8")
    pair = 'first = "a"\nsecond = "b"\n' if table == "selective" else ""
    (tmp_path / "chain.toml").write_text(f"{text}\n[{table}]\n{pair}samples = 100000000000\n", encoding="utf-8")
    found = command("doe", "chain", tmp_path / "chain.toml")
    assert (found.returncode, found.stdout) == (2, "")
    assert f"{table}.samples = 100000000000: must be at most {bound}" in found.stderr


def test_replicates_of_ten_thousand_runs_take_little_memory():
    """Unit: the groups of many runs are those of all distances at once, which would take 4.8 GB."""
    points = np.random.default_rng(3).integers(0, 30, (10_000, 3)).astype(float)
    _, first, group = np.unique(points, axis=0, return_index=True, return_inverse=True)
    assert np.array_equal(replicate_groups(points), first[group.ravel()])
    few, block = points[:300] // 10, np.arange(300) % 2
    all_at_once = (np.abs(few[:, None] - few[None]).max(axis=2) == 0) & (block[:, None] == block[None])
    assert np.array_equal(replicate_groups(few, block), all_at_once.argmax(axis=1))


def test_a_history_or_a_path_beyond_memory_is_refused(outer_result, tmp_path):
    """Command line: samples of a long motion and places of a turning ring have bounds that the sentence names."""
    record = outer_result.as_dict()
    record["scene"]["numerics"] |= {"samples_per_turn": 100_000, "turns": 100.0}
    path = tmp_path / "result.json"
    path.write_text(json.dumps(record), encoding="utf-8")
    found = command("rbdyn", "show", path, "--turns", "100")
    assert (found.returncode, found.stdout) == (2, "")
    # 60 of the state and 7 of each of 10 rollers, and 1e8 numbers in all.
    assert found.stderr == "--turns 100: memory has room for 7.692 turns of this scene; show no more\n"
    waves = "inner_roundness_random={lowest_order=2,highest_order=3,height_um=1.0}"
    scene = f"{EXAMPLES}/angular_contact_7014.toml"
    found = command("rbdyn", "ball", scene, "--set", f"errors={{steps=100000,turns=10000,{waves}}}")
    assert (found.returncode, found.stdout) == (2, "")
    assert "18000000000 places, more than the 1000000 that memory has room for" in found.stderr
