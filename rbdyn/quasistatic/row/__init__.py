"""One row of balls in equilibrium.

- ``row``: its geometry in SI; ``control``: hypotheses of raceway control; ``model``: both from a scene
- ``ball_motion``: orbit, spin, centrifugal force, gyroscopic moment; ``ball``: forces on one ball and their derivatives
- ``space``: what a solve is given and works in; ``place``: where the balls stand; ``ring``: forces on the inner ring, balls
  eliminated; ``elimination``: of a small dense system
- ``start``: first guess; ``newton``: convex start and full equations; ``equilibrium``: what Python calls
"""
