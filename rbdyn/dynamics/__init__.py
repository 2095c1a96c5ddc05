"""Cylindrical roller bearing in time, in the plane of rotation.

- ``parameters``: what is built once a scene; ``forces``: interactions, state and equations; ``integrators``: time stepping
- ``run``: one replicate under way; ``recording``: the same in batches, which can always go on; ``ensemble``: runs side by
  side; ``settling``: replicates that go on until their figures no longer drift; ``simulate``: what is gathered of them
- ``statistics``: figures and their errors; ``target``: a run to a target accuracy; ``slip_map``: figures over speed and load
- ``motion``: every motion and contact over time, on request

Frame: origin at the rest position of the outer ring's centre, x along the radial load, y 90 degrees ahead in the sense
of positive rotation, angles from x. Everything is SI. Roller j runs in pocket j, whose mid-line stands at the cage
angle plus 2 pi j/Z.
"""
