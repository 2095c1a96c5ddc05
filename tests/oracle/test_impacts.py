"""Impacts that are followed one by one, against closed forms: a roller on a wall, and forces that are known."""

import numpy as np
import pytest
from conftest import ROOT

from rbdyn.dynamics.ensemble import Stop
from rbdyn.dynamics.figures import DAMAGE, fatigue_force
from rbdyn.dynamics.forces.bodies import BalancedCage
from rbdyn.dynamics.forces.impacts import book_changes, book_impacts
from rbdyn.dynamics.forces.state import EXPONENTS, IMPACT_SUMS, NUMBER, PEAK_POWERS, POCKET_LOAD, SQUARES
from rbdyn.dynamics.integrators.advance import FINISHED, advance
from rbdyn.dynamics.parameters.model import roller_bearing
from rbdyn.dynamics.run import Run
from rbdyn.losses import POCKET_DAMPING, POCKET_FORCE
from rbdyn.scene import Scene

SPEED, RESTITUTION = 0.5, 0.6
# A roller between races that it does not touch, in a cage too heavy to move, on a wall of known restitution. Friction and drag
# of next to nothing have the kernels of other tests, where none would have its own.
ALONE = (
    "bearing.radial_clearance_mm=0.8",
    "operation.radial_load_N=0",
    "bearing.inner_ring_mass_kg=1e5",
    "model.pocket_friction=1e-12",
    "model.drag_coefficient=1e-12",
    f"model.pocket_restitution={RESTITUTION}",
    f"model.pocket_restitution_speed_m_s={SPEED}",
)


def on_wall(*overrides: str, side: float = 1.0, speed: float = SPEED, method: str = "rk45"):
    """The run and its bearing after a roller at ``speed`` [m/s] has hit a wall of its pocket; rollers and cage rest otherwise."""
    sets = [*ALONE, *overrides, f"numerics.method={method}"]
    scene = Scene.load(ROOT / "examples" / "cylindrical_roller.toml", sets)
    bearing = roller_bearing(scene)._replace(cage=BalancedCage(1e6, 1e6))
    run = Run(scene, bearing, 0, 1e-7, Stop())
    z, y = bearing.rollers, run.carry.y
    y[:] = 0.0
    radius = 0.5 * scene.bearing.pitch_diameter
    y[:z], y[z : 2 * z] = radius * bearing.pocket_cos, radius * bearing.pocket_sin
    # The first pocket lies on the x axis: across it is y.
    y[3 * z] = side * speed
    duration = 3.0 * 0.5 * scene.pocket_clearance_m / speed + 2e-4
    assert advance(bearing, run.control, run.carry, run.tally, duration, 1.0) == FINISHED
    return run, bearing, scene


@pytest.mark.parametrize("side", [1.0, -1.0])
@pytest.mark.parametrize("method", ["rk45", "rosenbrock"])
def test_oracle_roller_on_a_wall(side, method):
    """Oracle: Hunt and Crossley's wall gives m v (1 + e) and takes m v^2 (1 - e^2)/2; the impact is counted once with its speed."""
    run, bearing, _ = on_wall(side=side, method=method)
    mass, work, z = bearing.roller_mass, run.tally.work, bearing.rollers
    assert run.carry.y[3 * z] == pytest.approx(-side * RESTITUTION * SPEED, rel=1e-5)
    assert work[POCKET_FORCE] == pytest.approx(mass * SPEED * (1.0 + RESTITUTION), rel=1e-5)
    assert work[POCKET_DAMPING] == pytest.approx(0.5 * mass * SPEED**2 * (1.0 - RESTITUTION**2), rel=1e-5)
    sums = run.tally.impacts
    assert sums[0, NUMBER] == 1.0 and (sums[1:] == 0.0).all()
    assert sums[0, SQUARES] == pytest.approx(SPEED**2, rel=1e-9)
    # The largest of the loads at the ends of steps is below the peak between them.
    peak = sums[0, PEAK_POWERS] ** (1.0 / 8.0)
    assert 0.98 * run.tally.largest[POCKET_LOAD] < peak <= run.tally.largest[POCKET_LOAD]


@pytest.mark.parametrize(("threshold", "count"), [(0.49, 1.0), (0.51, 0.0)])
def test_unit_slower_contacts_are_no_impacts(threshold, count):
    """Unit: a contact counts where its first approach exceeds damage.impact_speed_m_s."""
    run, _, _ = on_wall(f"damage.impact_speed_m_s={threshold}")
    assert run.tally.impacts[:, NUMBER].sum() == count


def test_unit_impacts_on_film_and_lips():
    """Unit: with a film an impact begins where the film's floor is reached, slower than the roller came; lips count as walls do."""
    wet, _, _ = on_wall("model.pocket_film=true", method="verlet")
    assert wet.tally.impacts[0, NUMBER] == 1.0
    assert 0.0 < wet.tally.impacts[0, SQUARES] < SPEED**2
    lips = ("cage.guidance=roller", "cage.pocket_radial_clearance_mm=0.1")
    lipped, _, _ = on_wall(*lips, method="verlet")
    assert lipped.tally.impacts[0, SQUARES] == pytest.approx(SPEED**2, rel=1e-9)


def test_unit_energy_is_that_of_roller_and_free_cage():
    """Unit: the mean of squared speeds becomes m_r v^2/2 with 1/m_r = 1/m + 1/m_c + r^2/J_c."""
    _, _, scene = on_wall()
    (figure,) = (figure for figure in DAMAGE if figure.key == "impact_energy_J")
    geometry, radius = scene.geometry, 0.5e-3 * scene.bearing.pitch_diameter_mm
    inverse = 1.0 / geometry.roller_mass + 1.0 / scene.cage.mass + radius**2 / geometry.cage_inertia
    scale = figure.scale_in(scene)
    assert scale is not None and 2.0 * scale * inverse == pytest.approx(1.0)
    assert 0.0 < 2.0 * scale < geometry.roller_mass


def test_unit_equal_forces_tire_as_themselves():
    """Unit: equal peaks give their own force at any exponent, others lie between mean and largest, and none give 0."""
    for exponent in (1.0, 3.0, 8.0, 20.0):
        assert fatigue_force(np.array([7.0, 7.0 * 40.0**exponent, 7.0 * exponent])) == pytest.approx(40.0)
    forces = np.array([10.0, 20.0, 60.0])
    mixed = float(fatigue_force(np.array([3.0, (forces**8).sum(), 24.0])))
    assert mixed == pytest.approx((np.mean(forces**8)) ** 0.125) and 30.0 < mixed < 60.0
    assert fatigue_force(np.zeros(3)) == 0.0


def test_unit_contacts_are_followed_from_begin_to_end():
    """Unit: a contact that lasts over steps is one impact of its largest load; interpreted as compiled."""
    _, bearing, _ = on_wall()
    z, impacts = bearing.rollers, bearing.impacts
    followed, sums, y = np.zeros((2, z)), np.zeros((z, IMPACT_SUMS)), np.zeros(5 * z + 10)
    y[:z], y[z] = 1.0, 0.0
    y[3 * z + 2] = -0.3
    # Roller 3 nears the rear wall: its pocket is turned, so only the part across it counts.
    expected = 0.3 * bearing.pocket_cos[2]
    body = book_impacts.bodies[type(impacts)]
    for load in (0.0, 5.0, 30.0, 12.0, 0.0, 0.0):
        gap = np.full(z, 1e-5)
        gap[2] = -load if load else 1e-5
        body(impacts, bearing, y, gap, followed, sums)
    assert sums[2, NUMBER] == 1.0 and sums[2, EXPONENTS] == 8.0
    assert sums[2, PEAK_POWERS] == pytest.approx(30.0**8)
    assert np.sqrt(sums[2, SQUARES]) == pytest.approx(abs(expected))
    assert (followed == 0.0).all() and callable(book_changes)
