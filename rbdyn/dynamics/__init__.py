"""Cylindrical roller bearing in time, in the plane of rotation.

- ``parameters``: what a scene becomes for compiled code; ``forces``: interactions, state and equations; ``integrators``: time stepping
- ``run``: one replicate under way, and its method; ``recording``: the same in batches, until their figures no longer drift;
  ``ensemble``: runs side by side in threads
- ``simulate``: their figures as one result;
  ``temperatures``: those that the friction of a bearing keeps up; ``start``: those of a cold machine over time
- ``figures``: one list of them, which studies, maps, rigs and the manual follow; ``statistics``: their errors
- ``part_figures``: those of parts, and life, also over a duty, and stiffness by static loads, without a run
- ``cage_verdict``: class of the cage by its orbit; ``duty_simulation``: runs over a duty
- ``target``: a run to a target accuracy; ``slip_map``: figures over speed and load
- ``motion``: every motion and contact over time, on request

Frame: the origin is the rest position of the centre of the outer ring, with x along the radial load. y is 90 degrees ahead
in the sense of positive rotation; angles count from x. Everything is SI. Roller j runs in pocket j, whose mid-line is at the
cage angle plus 2 pi j/Z.
"""
