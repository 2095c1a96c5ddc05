"""Objectives with known fronts, and the surfaces of the published table, that several tests share."""

import re
from pathlib import Path

import numpy as np
from short_studies import with_paper_goals

from doe.workflow.problem import Problem
from doe.workflow.runs import read_runs
from doe.workflow.surfaces import fit_surfaces

EXAMPLES = Path(__file__).parents[2] / "examples"
TABLE = EXAMPLES / "ccd_table4.csv"
CORNERS = np.array([[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]])
LOWER, UPPER = [-1.0] * 3, [2.0] * 3


def bowls(count):
    """Squared distances to the first corners: the Pareto set is their convex hull."""
    return lambda points: ((points[:, None, :] - CORNERS[None, :count]) ** 2).sum(axis=2)


def edited_study(folder, *replacements):
    """The example study with a small search, without tolerances but of the pocket, and replaced text; in ``folder``."""
    text = with_paper_goals((EXAMPLES / "clearance_study.toml").read_text(encoding="utf-8"))
    text = text.replace("population = 100", "population = 40").replace("generations = 200", "generations = 30")
    text = re.sub(r"^tolerance(_aware)? = .*\n", "", text, flags=re.MULTILINE)
    pocket = 'factor = "pocket_clearance_mm"\n'
    text = text.replace(pocket, pocket + "half_width_mm = 0.005\n")
    for old, new in replacements:
        assert old in text, old
        text = text.replace(old, new)
    path = folder / "study.toml"
    path.write_text(text, encoding="utf-8")
    return Problem.load(path)


def table_surfaces(study):
    """Surfaces of the published table."""
    return fit_surfaces(study, read_runs(study, TABLE))


TOLERANCES = (
    ("step = 0.005\nresolution = 0.001 ", "step = 0.005\ntolerance = 0.001\nresolution = 0.001 "),
    ("centre = 0.15\nstep = 0.05\n", "centre = 0.15\nstep = 0.05\ntolerance = 0.01\n"),
)
