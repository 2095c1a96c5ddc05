"""The steps of a study, and the whole study that joins them.

- ``problem``: a study resolved once, with its goals, region and scenes, for every step, and what it asks
- ``region``: where its bearings run, and short runs before a study is written
- ``design``: its points; ``runs``: its runs with their replicates by need
- ``surfaces``: fits, predictions, random draws, a published table; ``front``: tolerances, the front on surfaces, back-off from
  limits; ``adaptive``: the front by emulators; ``front_record``: the records of both
- ``pick``: the point of the front, the edge of the region; ``tolerances``: its widest ones
- ``parts``: parts of a clearance and their grades; ``confirmation``: simulated points, intervals, limits
- ``obstacles``: what keeps a study from its demands, also before its runs; better simulated points
- ``input_sets``: unknown inputs and their runs; ``uncertainty``: ranges of outputs; ``robust``: whether the pick is better over
  them, with ``judgement`` as its record; ``duty``: the answer at every point of a duty
- ``rig``: measurements; ``calibration``: inputs from them, with ``identification`` as its record
- ``scene_table``: tables of scenes, and the runs of their rows
- ``status``: stages, identity and status of a command; ``effort``: threads or a cluster; ``whole``: the study, or a part of
  it for a job of a queue
"""
