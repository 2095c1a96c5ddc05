"""The course of a start, integrated anew from the heats, conductances and capacities of its JSON."""

import numpy as np
from scipy.integrate import solve_ivp

from rbdyn.result import StartResult
from rbdyn.thermal.start import WARMING_NODES


def stated(start: StartResult) -> np.ndarray:
    """Temperatures (6, rows) [C] of the JSON."""
    return np.array([start.path.temperatures_C[node] for node in WARMING_NODES])


def integrated(start: StartResult) -> np.ndarray:
    """The same by Radau."""
    path, times = start.path, np.array(start.path.time_s)
    heat = np.array([path.heat_W[node] for node in WARMING_NODES])
    g = {name: np.array(column) for name, column in path.conductances_W_K.items()}
    capacity = np.array([start.capacities_J_K[node] for node in WARMING_NODES])
    inlet, ambient = start.boundaries_C["inlet"], start.boundaries_C["ambient"]
    oil, outer, inner, rollers, housing, shaft = range(6)
    pairs = {
        "oil_outer": (oil, outer),
        "oil_inner": (oil, inner),
        "oil_rollers": (oil, rollers),
        "outer_rollers": (outer, rollers),
        "inner_rollers": (inner, rollers),
        "outer_housing": (outer, housing),
        "inner_shaft": (inner, shaft),
    }
    outside = {
        "flow": (oil, inlet),
        "sump": (oil, ambient),
        "housing_ambient": (housing, ambient),
        "shaft_ambient": (shaft, ambient),
    }
    assert {*pairs, *outside} == set(g)

    def rise(time: float, nodes: np.ndarray) -> np.ndarray:
        net = np.array([np.interp(time, times, column) for column in heat])
        for name, (one, other) in pairs.items():
            flow = np.interp(time, times, g[name]) * (nodes[one] - nodes[other])
            net[one] -= flow
            net[other] += flow
        for name, (node, around) in outside.items():
            net[node] -= np.interp(time, times, g[name]) * (nodes[node] - around)
        return net / capacity

    span = (0.0, times[-1])
    cold = np.full(6, 20.0)
    return solve_ivp(rise, span, cold, method="Radau", t_eval=times, rtol=1e-7, atol=1e-7, max_step=20.0).y
