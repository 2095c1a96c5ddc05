"""What turns the rings and loads the shaft, steadily; ``schedule`` has the drive that changes with time."""

from typing import NamedTuple

from rbdyn.compiled.kernel import law


class Action(NamedTuple):
    """Ring speeds [rad/s], the force on the inner ring [N], directions of the marks on the rings."""

    inner_speed: float
    outer_speed: float
    load_x: float
    load_y: float
    inner_cos: float
    inner_sin: float
    outer_cos: float
    outer_sin: float


class SteadyDrive(NamedTuple):
    """Inner ring at constant speed under a constant load along x, outer ring at rest."""

    inner_speed: float
    load_x: float


class TwoSpeedDrive(NamedTuple):
    """Both rings at constant speeds under a constant load along x."""

    inner_speed: float
    outer_speed: float
    load_x: float


@law
def action(drive, y):
    """The action at a state."""


@action.body(SteadyDrive)
def _(drive, y):
    return Action(drive.inner_speed, 0.0, drive.load_x, 0.0, 1.0, 0.0, 1.0, 0.0)


@action.body(TwoSpeedDrive)
def _(drive, y):
    return Action(drive.inner_speed, drive.outer_speed, drive.load_x, 0.0, 1.0, 0.0, 1.0, 0.0)


@law
def tick(drive, acting, row, dy):
    """Write the derivatives of the clock, where there is one."""


@tick.body(SteadyDrive, TwoSpeedDrive)
def _(drive, acting, row, dy):
    pass


@law
def load_power(drive, acting, vx, vy):
    """Power [W] that the load gives to the inner ring, where it has no potential."""


@load_power.body(SteadyDrive, TwoSpeedDrive)
def _(drive, acting, vx, vy):
    return 0.0


@law
def load_potential(drive, ring_x):
    """Potential energy [J] of a constant load; zero where its work is booked as power."""


@load_potential.body(SteadyDrive, TwoSpeedDrive)
def _(drive, ring_x):
    return -drive.load_x * ring_x
