"""Cylindrical roller bearing in time, in the plane of rotation.

- ``model``: the parameters that the compiled code reads, built once from a scene
- ``state``: the layout of the state vector and its units
- ``races``, ``pocket``, ``guide_land``, ``drag``: one interaction each
- ``equations``: forces gathered into accelerations, and the power that each loss takes
- ``runge_kutta``: Dormand-Prince 5(4) with step control
- ``start``: static load share, kinematic speeds, seeded pocket offsets
- ``metrics``: impact force, whirl deviation ratio, power loss from what the integrator kept
- ``simulate``: replicates, workers, error bars

Frame: origin at the centre of the fixed outer ring, x along the radial load, y 90 degrees ahead in the sense of
positive rotation, angles from x. Everything is SI. Roller j runs in pocket j, whose mid-line stands at the cage
angle plus 2 pi j/Z.
"""
