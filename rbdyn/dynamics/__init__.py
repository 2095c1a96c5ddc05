"""Cylindrical roller bearing in time, in the plane of rotation.

From the scene:
- ``geometry``: radii, masses, kinematic speeds, the sizes by which errors are measured
- ``model``, ``race_traction``: the parameters and laws that the compiled code reads, built once
- ``state``: the layout of the state vector and its units
- ``start``: kinematic speeds, seeded places in the pockets and the static load share (``static_load``)

Compiled:
- ``races``, ``race_form``, ``pocket``, ``guide_land``, ``drag``, ``gravity``: one interaction each
- ``cage_body``, ``ring_motion``, ``support``: how the cage and a supported outer ring move
- ``drive``, ``clock``, ``schedule``: speeds and loads, steady or by the clock
- ``equations``: forces gathered into accelerations, and the power that each loss takes; ``energy``: what balances it
- ``orbit_frame``: the frame in which the rollers are integrated
- ``runge_kutta``: the explicit pairs' step control, which also sees when stability holds the steps, and Dormand-Prince 5(4);
  ``kutta_pair``: Kutta's 3/8 rule; ``embedded_pair``: what it asks of either; ``booking``: what is kept of a step
- ``rosenbrock``: RODAS4 for scenes where it does, on ``jacobian`` and ``arrow_matrix``; ``implicit`` makes its storage

Results:
- ``method``: which of them integrates a run; ``ensemble``: runs side by side
- ``simulate``: replicates and what is gathered of them; ``recording``: a replicate in batches, which can always go on;
  ``settling``: replicates that go on until their figures no longer drift
- ``metrics``: impact force, whirl deviation ratio, power loss; their errors: ``batch_means`` (scatter), ``drift`` (slow
  change), ``bias`` (time integration), ``error_bars`` (all, and what is to be said of them)
- ``race_report``: pressure, half-width and film of each race; ``left_out``: what the model leaves out, with estimates
- ``history``, ``observe``: every motion and contact over time, on request
- ``orbit``, ``lyapunov``: what the cage does; ``life``, ``rating``, ``slice_loads``: ISO/TS 16281

Frame: origin at the rest position of the outer ring's centre, x along the radial load, y 90 degrees ahead in the sense
of positive rotation, angles from x. Everything is SI. Roller j runs in pocket j, whose mid-line stands at the cage
angle plus 2 pi j/Z.
"""
