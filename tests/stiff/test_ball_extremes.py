"""Equilibrium of a row of balls where it is hard to find: loads, speeds, angles and clearances at their ends."""

import numpy as np
import pytest
from ball_scenes import CAGE, HARD, LARGE, balanced, model_of, scene
from hypothesis import given, settings
from hypothesis import strategies as st

from rbdyn.quasistatic.row.equilibrium import solve
from rbdyn.quasistatic.row.model import constraint_of, row_of

FORCE = st.floats(-1.0, 1.0)


@given(power=st.floats(-1.0, 6.0), radial=FORCE, tilted=FORCE)
@settings(max_examples=40, deadline=None)
def test_stiff_seven_decades_of_load(power, radial, tilted):
    """Stiff: from 0.1 N to 1 MN on a bearing at 3 million mm rpm each load has its equilibrium."""
    size = 10.0**power
    for model in (CAGE, HARD):
        row, control = model_of(LARGE, operation={"inner_speed_rpm": 24_000.0}, model=model)
        balanced(row, control, np.array([size * radial, 0.0, size, 0.0, 0.02 * size * tilted]))


EXTREMES = {
    "45 degrees": ({"contact_angle_deg": 45.0}, {}, [500.0, 0.0, 4000.0, 0.0, 0.0]),
    "no contact angle": ({"contact_angle_deg": 0.0}, {}, [5000.0, 0.0, 10.0, 0.0, 0.0]),
    "three balls": ({"balls": 3}, {}, [900.0, 200.0, 4000.0, 5.0, 0.0]),
    "a hundred balls": ({"balls": 100, "ball_diameter_mm": 3.0}, {}, [900.0, 200.0, 4000.0, 5.0, 0.0]),
    "hardly a clearance": ({"contact_angle_deg": None, "radial_clearance_mm": 1e-6}, {}, [5000.0, 0.0, 0.0, 0.0, 0.0]),
    "a huge clearance": ({"contact_angle_deg": None, "radial_clearance_mm": 0.9}, {}, [5000.0, 0.0, 900.0, 0.0, 0.0]),
    "interference": ({"contact_angle_deg": None, "radial_clearance_mm": -0.08}, {}, [50.0, 0.0, 9.0, 1.0, 0.0]),
    "one ball loaded": ({"balls": 8, "contact_angle_deg": None, "radial_clearance_mm": 0.8}, {"tilt": "fixed"}, [40.0, 0.0, 0.0, 0.0, 0.0]),
    "pure moment": ({}, {}, [0.0, 0.0, 0.0, 0.0, 400.0]),
    "grooves as wide as the ball": ({"inner_groove_factor": 1.0, "outer_groove_factor": 1.0}, {}, [500.0, 0.0, 4000.0, 0.0, 0.0]),
    "grooves that all but clasp the ball": ({"inner_groove_factor": 0.5005, "outer_groove_factor": 0.5005}, {}, [500.0, 0.0, 4000.0, 0.0, 0.0]),
}  # fmt: skip


@pytest.mark.parametrize("speed", [0.0, 24_000.0])
@pytest.mark.parametrize("name", EXTREMES)
def test_stiff_extremes(name, speed):
    """Stiff: angles, clearances, grooves and numbers of balls at the ends of what is made have their equilibrium."""
    bearing, operation, load = EXTREMES[name]
    for model in (CAGE, HARD):
        case_ = scene(
            LARGE,
            bearing=bearing,
            operation={"inner_speed_rpm": speed, "load_N": load[:3], "moment_Nm": None, **operation},
            model=model,
        )
        parts = row_of(case_)
        found = balanced(parts.row, parts.control, np.array(load), constraint_of(case_))
        if name == "one ball loaded":
            assert np.count_nonzero(found.inner_load > 1e-9) == 1


def test_stiff_where_there_is_no_equilibrium_a_sentence_tells():
    """Stiff: nearly no load that brings race control in lets a ball have several orbits: a sentence with a remedy, nothing raised."""
    load = np.array([0.0, 0.0, 100.0, 0.0, 0.0])
    abrupt = {"raceway_control": "inner", "light_load_share": 1e-3}
    row, control = model_of(LARGE, operation={"inner_speed_rpm": 30_000.0}, model=abrupt)
    lost = solve(row, control, load)
    assert not lost.is_equilibrium
    assert "no equilibrium was found" in lost.status and "raise model.light_load_share" in lost.status
    assert not any(np.isnan(part).any() for part in lost if isinstance(part, np.ndarray))
    balanced(*model_of(LARGE, operation={"inner_speed_rpm": 30_000.0}, model={"raceway_control": "inner"}), load)
