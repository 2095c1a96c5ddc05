"""A cage that thick oil stops within a step: resistance of the film, decay, order, price, and where no scene pays for it."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from smooth_runs import fixed_step, run_of
from test_runge_kutta import slope_of

from rbdyn.contact.cage_film import ShortJournalFilm, StoppingFilm, stopping_rate
from rbdyn.dynamics.forces import state
from rbdyn.dynamics.forces.cage import film_wrench
from rbdyn.dynamics.integrators import advance as at
from rbdyn.dynamics.integrators import stopped_cage
from rbdyn.dynamics.parameters.model import roller_bearing
from rbdyn.dynamics.parameters.state import layout_of

COLD = "lubricant.temperature_C=-40"
FILM = ShortJournalFilm(2.0, 0.1, 75e-6, 0.96)


@given(angle=st.floats(0.0, 6.3), share=st.floats(0.01, 0.9), course=st.floats(0.0, 6.3), speed=st.floats(1e-3, 1.0))
@settings(max_examples=100, deadline=None)
def test_oracle_resistance_of_the_film(angle, share, course, speed):
    """Oracle: the resistance is less the slope of the film's force over the velocity, by central differences."""
    ex, ey, e = math.cos(angle), math.sin(angle), share * FILM.clearance
    vx, vy, small = speed * math.cos(course), speed * math.sin(course), 1e-5 * speed

    def at_velocity(vx, vy):
        return film_wrench(FILM, ex, ey, e, vx, vy, 300.0, 0.0)

    found = at_velocity(vx, vy).resistance
    along_x, along_y = (
        np.array([(b.x - a.x) / (2.0 * small), (b.y - a.y) / (2.0 * small)])
        for a, b in (
            (at_velocity(vx - small, vy), at_velocity(vx + small, vy)),
            (at_velocity(vx, vy - small), at_velocity(vx, vy + small)),
        )
    )
    size = found.xx + found.yy
    assert -along_x == pytest.approx([found.xx, found.xy], abs=1e-3 * size)
    assert -along_y == pytest.approx([found.xy, found.yy], abs=1e-3 * size)
    assert found.xx * found.yy > found.xy**2


SUPPORT = ("support.outer_ring_mass_kg=0.4", "support.stiffness_N_m=5e7", "support.damping_N_s_m=2e3")


def resist(film, rates, cage, ring, speeds):
    """Write the rates of cage and ring in a film of such a resistance [N s/m] along x; returns the relative speed."""
    mass, resistance = film
    moving = speeds[cage] - (speeds[ring.speed] if ring.speed >= 0 else 0.0)
    rates[cage] = -resistance * moving / mass
    if ring.speed >= 0:
        rates[ring.speed] = resistance * moving * ring.per_mass
    return moving


@pytest.mark.parametrize("sets", [(), ("cage.guidance=inner",), SUPPORT])
def test_oracle_decay_in_a_film(make_scene, sets):
    """Oracle: cage and ring in a film of constant resistance decay by the trapezoidal rule, reverse by half in longer steps, and keep
    their momentum.
    """
    bearing = roller_bearing(make_scene(COLD, *sets))
    mass, z = bearing.cage.mass, bearing.rollers
    n, h = 5 * z + 20, 1e-6
    ring = stopped_cage.partner_of(bearing.guide, bearing)
    cage = 5 * z + state.CAGE_VX
    per_mass = 1.0 / mass + ring.per_mass
    for stiffness in (0.3, 2.0, 30.0, 1e6):
        rate = stiffness / h
        work = at.carry_from(np.zeros(n), z, h, None).scratch
        # The film resists along x alone, so its trace is the rate.
        work.resistance[:] = rate / per_mass, 0.0, 0.0
        y, k, end = np.zeros(n), np.zeros((at.ROWS, n)), np.zeros(n)
        y[cage], film = 1.0, (mass, rate / per_mass)
        resist(film, k[0], cage, ring, y)
        stopped_cage.predict_cage.py_func(bearing, work, h, y, k, end)
        resist(film, k[1], cage, ring, end)
        stopped_cage.correct_cage.py_func(bearing, work, h, y, k, end)
        decayed = max((2.0 - stiffness) / (2.0 + stiffness), -stopped_cage.REVERSED)
        kept = k[1].copy()
        assert resist(film, k[1], cage, ring, end) == pytest.approx(decayed, abs=1e-9)
        assert kept == pytest.approx(k[1], rel=1e-6, abs=1e-9 * rate)
        if ring.speed >= 0:
            assert mass * end[cage] + end[ring.speed] / ring.per_mass == pytest.approx(mass, rel=1e-9)


@pytest.mark.parametrize("stiffness", [0.5, 3.0, 12.0])
def test_oracle_a_force_that_the_film_balances(make_scene, stiffness):
    """Oracle: under an oscillating force that the film nearly balances, the speed of the cage errs by the change of their resultant.

    Pade's approximation errs by that of the force: 9 to 40 times as much.
    """
    bearing = roller_bearing(make_scene(COLD))
    mass, z, h, turn = bearing.cage.mass, bearing.rollers, 1e-6, 0.05
    cage, rate = 5 * z + state.CAGE_VX, stiffness / h
    work = at.carry_from(np.zeros(5 * z + 20), z, h, None).scratch
    work.resistance[:] = mass * rate, 0.0, 0.0
    y, k, end = np.zeros(5 * z + 20), np.zeros((at.ROWS, 5 * z + 20)), np.zeros(5 * z + 20)
    balanced = 1.0 / (1.0 - 1j * turn / stiffness)
    y[cage] = balanced.real
    k[0, cage] = rate * (1.0 - y[cage])
    errors = []
    for step in range(1, 200):
        stopped_cage.predict_cage.py_func(bearing, work, h, y, k, end)
        k[1, cage] = rate * (math.cos(turn * step) - end[cage])
        stopped_cage.correct_cage.py_func(bearing, work, h, y, k, end)
        y[:], k[0] = end, k[1]
        errors.append(abs(y[cage] - (balanced * np.exp(-1j * turn * step)).real))
    beyond_half = stopped_cage.share_at_end.py_func(bearing, work, 0, h) - 0.5
    assert max(errors) < 1.6 * (turn / 12.0 + beyond_half) * turn**2 / stiffness


def test_rate_order_two_in_a_film(make_scene):
    """Rate: errors of the cage's speeds fall with the square of the step, through steps in which the film stops it."""
    scene, duration, steps = make_scene(COLD), 3.2e-5, np.array([3.2e-5 / n for n in (16, 24, 32, 48)])
    film = roller_bearing(scene).guide.film
    assert isinstance(film, StoppingFilm) and stopping_rate(film, scene.cage.mass) * steps[-1] > stopped_cage.STIFF
    reference = fixed_step(scene, duration / 4096, duration, "verlet")
    first = layout_of(scene).first_body + state.CAGE_VX
    errors = [np.abs(fixed_step(scene, h, duration, "verlet") - reference)[first : first + 2].max() for h in steps]
    assert slope_of(steps, np.array(errors)) > 1.7


def test_unit_cold_bearings_cost_no_more(make_scene):
    """Unit: the film of oil at -54 C leaves the steps to the contacts; explicit ones end at a product of 1 with its rates."""
    scene = make_scene("lubricant.temperature_C=-54")
    run = run_of(scene, 1e-2, "verlet")
    run.to(0.5)
    fewest = stopping_rate(roller_bearing(scene).guide.film, scene.cage.mass) * run.carry.clock[at.NOW]
    assert run.steps < 0.4 * fewest


def test_unit_warm_bearings_leave_it_out(make_scene):
    """Unit: at working temperature no film stops the cage within a step, so that no code for it is compiled."""
    assert isinstance(roller_bearing(make_scene()).guide.film, ShortJournalFilm)
    assert isinstance(roller_bearing(make_scene(COLD)).guide.film, StoppingFilm)
