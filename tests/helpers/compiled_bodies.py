"""Compile the right-hand side of scenes, one after the other, and print which functions of the package that took.

``test_leave_out`` runs this in a process where nothing was compiled before. Standard input: a JSON list of scenes, each
a list of assignments to the example. Standard output: for each scene, "module:line" of every function compiled for it
or for one before it.
"""

import json
import sys

import numba
import numpy as np
from conftest import make
from numba.core import event

from rbdyn.dynamics.forces.equations import derivative
from rbdyn.dynamics.forces.race_lanes import scratch
from rbdyn.dynamics.parameters.model import roller_bearing


class Recorder(event.Listener):
    """Notes every function that is compiled; one that is already compiled for its types makes no event."""

    def __init__(self):
        self.compiled = set()

    def on_start(self, event):
        function = event.data["dispatcher"].py_func
        if function.__module__.startswith("rbdyn."):
            self.compiled.add(f"{function.__module__}:{function.__code__.co_firstlineno}")

    def on_end(self, event):
        pass


def main():
    recorder = Recorder()
    event.register("numba:compile", recorder)
    found = []
    vector, matrix = np.zeros(1), np.zeros((1, 1))
    for assignments in json.load(sys.stdin):
        bearing = roller_bearing(make(*assignments))
        arguments = (bearing, vector, 0, matrix, matrix, matrix, scratch(bearing.rollers))
        derivative.compile(tuple(numba.typeof(argument) for argument in arguments))
        found.append(sorted(recorder.compiled))
    print(json.dumps(found))


if __name__ == "__main__":
    main()
