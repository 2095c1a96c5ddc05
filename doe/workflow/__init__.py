"""The study that joins the steps, and what it is made of.

- ``runs``: design and runs; ``goals``: goals, tolerances and region; ``surfaces``: a surface for each response, draws of it, predictions, a published table next to it
- ``confirmation``: fresh runs at chosen points, intervals, limits; ``front``: the front on surfaces, back-off, shares of parts
- ``adaptive``: the front found by emulators; ``pick``: which point, how far it is limited by region and tolerances
- ``input_sets``, ``uncertainty``, ``robust``: unknown inputs, what they do, whether the pick is better all the same
- ``rig``, ``calibration``: measurements, and inputs from them
- ``status``, ``stages_unknown``: what a command runs, and where it stands; ``whole``: the study
"""
