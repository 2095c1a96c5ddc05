"""Ball bearings in equilibrium.

- ``race_errors``: form errors of grooves and balls, as each ball meets them through the turns of the ring
- ``runout``: radial and axial runout of the ring's path, synchronous and asynchronous parts
- ``runout_class``: limits of running accuracy by tolerance class

Conventions: x radial (direction of the load), z axial, balls at psi_j = 2 pi j/Z from x. The inner ring moves, the outer
ring is the reference. All SI.
"""
