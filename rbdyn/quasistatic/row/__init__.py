"""One row of balls in equilibrium.

- ``ball``: raceway control, orbit and spin, centrifugal force, gyroscopic moment, forces on one ball and their derivatives
- ``ring``: geometry of a row in SI, where its balls stand, forces on the inner ring with the balls eliminated
- ``newton``: what a solve is given and works in, first guess, convex start and full equations
- ``equilibrium``: what Python calls; ``model``: from a scene
"""
