"""Line contact: load against approach by Palmgren's 10/9 law (Chen et al. 2022, eq 6)."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from rbdyn.elementary import fast_exp, fast_log
from rbdyn.kernel import kernel, law

EXPONENT = 10.0 / 9.0


class LineContact(NamedTuple):
    """One slice, exact where there is neither profile nor tilt: Q = K delta^(10/9)."""

    stiffness: float  # K [N/m^(10/9)]


class SlicedLineContact(NamedTuple):
    """Equal slices, each relieved by the roller's profile: Q = sum_k K/m (delta - P_k)_+^(10/9)."""

    slice_stiffness: float  # K/m [N/m^(10/9)]
    relief: NDArray[np.float64]  # profile drop at the slice centres [m]


class LineContactOnBar(NamedTuple):
    """A line contact in series with the elastic cross-bar of a cage pocket."""

    stiffness: float  # K [N/m^(10/9)]
    bar_stiffness: float  # [N/m]


def palmgren_stiffness(equivalent_modulus: float, length: float) -> float:
    """Palmgren's K = (E'/8) (1/0.39)^(10/9) l^(8/9) [N/m^(10/9)].

    With E' of steel on steel this is delta = 3.84e-5 Q^0.9 / l^0.8 (mm, N). Chen et al. 2022, eq 6, summed
    over the slices: the -1/9 power holds the whole length, so any number of slices gives the same sum.
    """
    return equivalent_modulus / 8.0 * (1.0 / 0.39) ** EXPONENT * length ** (8.0 / 9.0)


def slice_centres(slices: int, length: float) -> NDArray[np.float64]:
    """Axial positions of the slice centres from the roller's middle [m] (Chen et al. 2022, eq 2)."""
    return (-0.5 + (np.arange(1, slices + 1) - 0.5) / slices) * length


def logarithmic_relief(position: NDArray[np.float64], diameter: float, length: float) -> NDArray[np.float64]:
    """Reference profile drop of ISO/TS 16281 at axial ``position`` [m], for rollers of l <= 2.5 D and longer.

    P(x) = 0.00035 D ln[1/(1 - (2x/l)^2)]; longer rollers keep a flat middle of l - 2.5 D and 0.0005 D.
    """
    flat = max(length - 2.5 * diameter, 0.0)
    factor = 0.0005 if flat > 0.0 else 0.00035
    inside = np.clip((2.0 * np.abs(position) - flat) / (length - flat), 0.0, None)
    return np.asarray(-factor * diameter * np.log1p(-(inside**2)))


@kernel
def power_10_9(approach: float) -> float:
    """x^(10/9) of a positive x, as x exp(ln(x)/9): several times as fast as the general power."""
    return approach * fast_exp(fast_log(approach) * (1.0 / 9.0))


@law
def elastic_load(contact, approach):
    """Elastic load [N] of a line contact at a positive approach [m]."""


@elastic_load.body(LineContact)
def _(contact, approach):
    return contact.stiffness * power_10_9(approach)


@elastic_load.body(SlicedLineContact)
def _(contact, approach):
    load = 0.0
    for relief in contact.relief:
        if approach > relief:
            load += power_10_9(approach - relief)
    return contact.slice_stiffness * load


@elastic_load.body(LineContactOnBar)
def _(contact, approach):
    # With y^9 the indentation, K y^10/k_bar + y^9 = approach is a polynomial: Halley's method needs no powers,
    # and falls from y^9 = approach, above the root, to it.
    ratio = contact.stiffness / contact.bar_stiffness
    y = fast_exp(fast_log(approach) * (1.0 / 9.0))
    for _ in range(20):
        y7 = y**7
        value = y7 * y * y * (ratio * y + 1.0) - approach
        slope = y7 * y * (10.0 * ratio * y + 9.0)
        bend = y7 * (90.0 * ratio * y + 72.0)
        step = 2.0 * value * slope / (2.0 * slope * slope - value * bend)
        y -= step
        # The error is cubed: after a step of 1e-6 nothing is left to gain.
        if abs(step) < 1e-6 * y:
            break
    return contact.stiffness * y**10


@law
def elastic_energy(contact, approach):
    """Energy [J] stored in a line contact at a positive approach [m]: the integral of its elastic load."""


@elastic_energy.body(LineContact)
def _(contact, approach):
    return 9.0 / 19.0 * contact.stiffness * power_10_9(approach) * approach


@elastic_energy.body(SlicedLineContact)
def _(contact, approach):
    energy = 0.0
    for relief in contact.relief:
        if approach > relief:
            energy += power_10_9(approach - relief) * (approach - relief)
    return 9.0 / 19.0 * contact.slice_stiffness * energy


@elastic_energy.body(LineContactOnBar)
def _(contact, approach):
    load = elastic_load(contact, approach)
    bar_deflection = load / contact.bar_stiffness
    return 9.0 / 19.0 * load * (approach - bar_deflection) + 0.5 * load * bar_deflection
