"""The commands of ``doe``. They import methods inside their functions, so that help comes at once.

- ``study``: the whole study, and its status; ``steps``: one step alone (design, fit, front, chain)
- ``unknown``: uncertainty and calibration; ``keys``: the meaning of keys
- ``new``: a new study with its limits; ``new_parts``: tolerances and dimension chains of the parts that make its clearances
- ``options``: options of several commands, with the runs, agenda and record that follow from them
"""
