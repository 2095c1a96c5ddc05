"""One row of balls in equilibrium.

- ``ball``: raceway control, orbit and spin, centrifugal force, gyroscopic moment, forces on one ball and their derivatives
- ``ring``: geometry of a row in SI, rest positions of its balls, forces on the inner ring with the balls eliminated
- ``newton``: task and state of a solve, first guess, convex problem, full equations, and paths of many steps
- ``equilibrium``: ``solve`` and its ``Solution``, called from Python; ``model``: a row from a scene
"""
