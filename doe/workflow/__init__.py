"""The steps of a study, and the whole study that joins them.

- ``runs``: the design with its region, and its runs; ``surfaces``: goals, fits, predictions, random draws, a published table
- ``confirmation``: simulated points, intervals, limits; ``front``: tolerances, the front on surfaces, back-off from limits
- ``adaptive``: the front by emulators; ``pick``: the point of the front, the edge of the region
- ``parts``: parts of a clearance and their grades; ``tolerances``: the widest tolerances of the pick
- ``input_sets``: unknown inputs and their runs; ``uncertainty``: ranges
  of outputs; ``robust``: judgement of the pick; ``duty``: the answer at every point of a duty
- ``rig``: measurements; ``calibration``: inputs from measurements
- ``status``: stages and status of a command; ``whole``: the study
"""
