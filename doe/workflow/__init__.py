"""The steps of a study, and the whole study that joins them.

- ``problem``: a study resolved once, with its goals, region, tolerances, scenes and surfaces, which every step is handed
- ``design``: the points of the runs; ``region``: where bearings run; ``effort``: how runs are made; ``runs``: their results
- ``surfaces``: fits, predictions, random draws, a published table
- ``confirmation``: simulated points, intervals, limits; ``front``: tolerances, the front on surfaces, back-off from limits
- ``adaptive``: the front by emulators; ``pick``: the point of the front, the edge of the region
- ``parts``: parts of a clearance and their grades; ``tolerances``: the widest tolerances of the pick
- ``input_sets``: unknown inputs and their runs; ``uncertainty``: ranges
  of outputs; ``robust``: judgement of the pick; ``duty``: the answer at every point of a duty
- ``rig``: measurements; ``calibration``: inputs from measurements
- ``status``: stages and status of a command; ``whole``: the study
"""
