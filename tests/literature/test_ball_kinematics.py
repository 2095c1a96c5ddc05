"""Orbit and spin of a ball between two races: rolling by vectors, Jones's limits, the sign of the gyroscopic moment."""

import math

import numpy as np
import pytest
from ball_oracle import Rolling, derivatives
from hypothesis import given, settings
from hypothesis import strategies as st
from mpmath import fp, mp
from numba import njit

from rbdyn.base.faults import RPM
from rbdyn.properties.materials import MATERIALS
from rbdyn.quasistatic.row.ball import FixedShare, Spinning, ball_forces, orbit_and_spin
from rbdyn.quasistatic.row.model import cage_speed, row_model
from rbdyn.scene.ball import BallModel, BallRow

DIAMETER, PITCH, DENSITY = 0.0127, 0.070, 7800.0
MASS = DENSITY * math.pi * DIAMETER**3 / 6.0
INERTIA = 0.1 * MASS * DIAMETER**2
ANGLE = st.floats(-1.2, 1.2)
SPEED = st.floats(-5000.0, 5000.0)


@njit
def compiled_motion(spinning, share, ci, si, co, so):
    return orbit_and_spin(spinning, share, ci, si, co, so)


def spinning_of(inner_speed, outer_speed=0.0, turning=-1.0):
    """What orbit and spin of a half-inch steel ball depend on."""
    return Spinning(
        DIAMETER / PITCH, DIAMETER, 0.5 * MASS * PITCH, INERTIA, turning, inner_speed, outer_speed, 1e-200, 1e9
    )


def motion_of(spinning, share, inner, outer, motion=compiled_motion):
    """F_c and M_g, each with three derivatives, at contact angles in rad."""
    return motion(spinning, share, math.cos(inner), math.sin(inner), math.cos(outer), math.sin(outer))


@given(share=st.floats(0.0, 1.0), inner=ANGLE, spread=st.floats(-0.8, 0.8), inner_speed=SPEED, outer_speed=SPEED)
@settings(max_examples=60, deadline=None)
def test_oracle_rolling_by_vectors(share, inner, spread, inner_speed, outer_speed):
    """Oracle: orbit and spin for which both contacts roll without slip and the spin moments balance, by vectors to 40 digits.

    Forces and derivatives, compiled and interpreted, to 1e-11 of the largest that these speeds could give.
    """
    outer = max(-1.2, min(inner + spread, 1.2))
    spinning = spinning_of(inner_speed, outer_speed)

    def exact(inner, outer, share):
        sides = ((mp.sin(a), mp.cos(a)) for a in (inner, outer))
        rolling = Rolling(mp, mp.mpf(DIAMETER) / PITCH, share, *sides, inner_speed, outer_speed)
        assert abs(rolling.inner_slip) + abs(rolling.outer_slip) < 1e-30
        assert abs(share * rolling.inner_spin + (1 - share) * rolling.outer_spin) < 1e-30
        pull = mp.mpf(spinning.orbit_mass) * rolling.orbit**2
        return pull, -mp.mpf(spinning.inertia) * rolling.orbit * rolling.radial

    arguments = (mp.mpf(inner), mp.mpf(outer), mp.mpf(share))
    values, slopes = exact(*arguments), derivatives(exact, *arguments)
    scale = (abs(inner_speed) + abs(outer_speed)) ** 2
    for motion in (compiled_motion, orbit_and_spin.py_func):
        found = motion_of(spinning, share, inner, outer, motion)
        for part, size, value, slope in zip(
            found, (spinning.orbit_mass, spinning.inertia / spinning.ratio), values, slopes, strict=True
        ):
            assert part[0] == pytest.approx(float(value), rel=1e-11, abs=1e-12 * size * scale)
            assert part[1:] == pytest.approx(slope, rel=1e-10, abs=1e-11 * size * scale)


@pytest.mark.parametrize(("inner", "outer"), [(0.7, 0.7), (0.9, 0.55), (0.1, -0.05), (1.1, 0.2)])
def test_literature_outer_and_inner_raceway_control(inner, outer):
    """Literature: closed forms of Jones as Harris prints them, inner ring turning, and no spin on the race that rules."""
    g, w = DIAMETER / PITCH, 10_000.0 * RPM
    ci, si, co, so = math.cos(inner), math.sin(inner), math.cos(outer), math.sin(outer)
    both = 1.0 + math.cos(inner - outer)
    for share, pitch_angle, orbit in (
        (0.0, math.atan2(so, co + g), w * (1.0 - g * ci) / both),
        (1.0, math.atan2(si, ci - g), w * (math.cos(inner - outer) - g * co) / both),
    ):
        cb, sb = math.cos(pitch_angle), math.sin(pitch_angle)
        spin = -w / (((co * cb + so * sb) / (1.0 + g * co) + (ci * cb + si * sb) / (1.0 - g * ci)) * g)
        (pull, *_), (moment, *_) = motion_of(spinning_of(w), share, inner, outer)
        assert pull == pytest.approx(0.5 * MASS * PITCH * orbit**2, rel=1e-13)
        assert moment == pytest.approx(INERTIA * spin * orbit * sb, rel=1e-12)
        rolling = Rolling(fp, g, share, (si, ci), (so, co), w, 0.0)
        free, ruled = (
            (rolling.inner_spin, rolling.outer_spin) if share == 0.0 else (rolling.outer_spin, rolling.inner_spin)
        )
        assert abs(ruled) < 1e-11 * w and abs(free) > 1e-3 * w


def test_limit_equal_angles_are_the_epicyclic_cage():
    """Limit: with both angles alike every hypothesis has the orbit of the epicyclic gear, turning rings added."""
    g, angle = DIAMETER / PITCH, 0.6
    for w_in, w_out in ((1000.0, 0.0), (0.0, 1000.0), (1000.0, -400.0), (700.0, 700.0)):
        cage = 0.5 * (w_in * (1.0 - g * math.cos(angle)) + w_out * (1.0 + g * math.cos(angle)))
        for share in (0.0, 0.3, 1.0):
            (pull, *_), _ = motion_of(spinning_of(w_in, w_out), share, angle, angle)
            assert pull == pytest.approx(0.5 * MASS * PITCH * cage**2, rel=1e-12)


def test_limit_rings_turning_together_carry_the_ball_along():
    """Limit: without relative speed the bearing turns as one body: F_c of that speed, and no spin of the ball's own."""
    (pull, *slopes), moment = motion_of(spinning_of(800.0, 800.0), 0.4, 0.7, 0.3)
    assert pull == pytest.approx(0.5 * MASS * PITCH * 800.0**2, rel=1e-14)
    assert max(map(abs, (*slopes, *moment))) == 0.0


def test_literature_cage_speed():
    """Literature: D 12.7 mm on 70 mm at 40 degrees, 10000 rpm of the inner ring: a cage of 4305.1 rpm."""
    drawing = BallRow(
        balls=12, ball_diameter_mm=12.7, pitch_diameter_mm=70.0, contact_angle_deg=40.0,
        inner_groove_factor=0.52, outer_groove_factor=0.52,
    )  # fmt: skip
    assert cage_speed(drawing, 10_000.0 * RPM, 0.0) / RPM == pytest.approx(4305.1, abs=0.05)
    steel = MATERIALS["bearing_steel"]
    model = row_model(drawing, BallModel(), steel, steel, steel, 10_000.0 * RPM, 0.0)
    spinning = model.control.spinning
    (pull, *_), _ = motion_of(spinning, 0.0, math.radians(40.0), math.radians(40.0))
    assert pull == pytest.approx(model.row.centrifugal_force, rel=1e-13)
    assert math.sqrt(pull / spinning.orbit_mass) / RPM == pytest.approx(4305.1, abs=0.05)


def couple_of_inertia(orbit, axial, radial):
    """Moment about the centre that keeps a solid sphere turning at (axial, radial) while it orbits: r x a over its volume.

    Vectors (axial, radial, along the orbit), steady in a frame that turns with the orbit: relative, Coriolis and frame
    acceleration of every bit of the ball. The products are quadratic, which these points integrate exactly.
    """
    nodes, weights = np.polynomial.legendre.leggauss(4)
    turns = 2.0 * np.pi * np.arange(8) / 8
    r, cosine, turn = np.meshgrid(0.25 * DIAMETER * (1.0 + nodes), nodes, turns, indexing="ij")
    sine = np.sqrt(1.0 - cosine**2)
    bits = np.stack((r * cosine, r * sine * np.cos(turn), r * sine * np.sin(turn)), -1)
    volume = np.einsum("i,j->ij", 0.25 * DIAMETER * weights, weights)[:, :, None] * r**2 * (2.0 * np.pi / 8)
    assert volume.sum() == pytest.approx(math.pi * DIAMETER**3 / 6.0, rel=1e-13)
    # e_z x e_r = e_psi, which is the right-handed order of the three.
    frame, own = np.array([orbit, 0.0, 0.0]), np.array([axial - orbit, radial, 0.0])
    moving = np.cross(own, bits)
    pushed = np.cross(own, moving) + 2.0 * np.cross(frame, moving) + np.cross(frame, np.cross(frame, bits))
    return DENSITY * np.einsum("ijk,ijkl->l", volume, np.cross(bits, pushed))


@pytest.mark.parametrize(
    ("inner_speed", "outer_speed", "sign"), [(1500.0, 0.0, -1.0), (0.0, 1500.0, 1.0), (-1500.0, 0.0, -1.0)]
)
@pytest.mark.parametrize("share", [0.0, 0.35, 1.0])
def test_first_principles_friction_turns_the_ball_with_its_orbit(share, inner_speed, outer_speed, sign):
    """First principles: the friction of the ball equations is the couple that a spinning, orbiting sphere needs.

    Its inertia is integrated over the volume. With the inner ring turning M_g is negative; without its sign the same
    equations turn the ball the wrong way.
    """
    row = BallRow(
        balls=12, ball_diameter_mm=1e3 * DIAMETER, pitch_diameter_mm=1e3 * PITCH, contact_angle_deg=30.0,
        inner_groove_factor=0.52, outer_groove_factor=0.53,
    )  # fmt: skip
    steel = MATERIALS["bearing_steel"]
    parts = row_model(row, BallModel(), steel, steel, steel, inner_speed, outer_speed).row
    # A ball that is pressed 20 um into both races, at 40 and 33 degrees.
    di = do = 20e-6
    ai, ao = math.radians(40.0), math.radians(33.0)
    normal_i, normal_o = (np.array([math.sin(a), math.cos(a)]) for a in (ai, ao))
    x = (parts.outer_reach[0] + do) * normal_o
    a = x + (parts.inner_reach[0] + di) * normal_i

    def friction(turning):
        """Friction on the ball at the inner and the outer contact, and M_g: with less without moment of inertia."""
        spinning = spinning_of(inner_speed, outer_speed, turning)
        told = [
            ball_forces(FixedShare(share, s), 1.0, parts, *a, *x, di, do)
            for s in (spinning, spinning._replace(inertia=0.0))
        ]
        inner = np.subtract(told[0][1][:2], told[1][1][:2])
        # The ring takes the couple of that force about its groove centre; as an axial force at a lever, against e_psi.
        taken = -parts.inner_groove_radius * cross(-normal_i, inner)
        assert told[0][1][2] == pytest.approx(taken, rel=1e-9, abs=1e-12)
        return inner, np.subtract(told[0][0], told[1][0]) - inner, told[0][7]

    rolling = Rolling(fp, DIAMETER / PITCH, share, tuple(normal_i), tuple(normal_o), inner_speed, outer_speed)
    needed = couple_of_inertia(rolling.orbit, rolling.axial, rolling.radial)
    assert np.abs(needed[:2]).max() < 1e-12 * abs(needed[2])
    for turning, agrees in ((-1.0, 1.0), (1.0, -1.0)):
        inner, outer, moment = friction(turning)
        couple = 0.5 * DIAMETER * (cross(-normal_i, inner) + cross(normal_o, outer))
        assert couple == pytest.approx(agrees * needed[2], rel=1e-9)
        assert moment == pytest.approx(-agrees * needed[2], rel=1e-9)
    assert math.copysign(1.0, -needed[2]) == sign


def cross(r, force):
    """Component along the orbit of r x force, both (axial, radial)."""
    return r[0] * force[1] - r[1] * force[0]
