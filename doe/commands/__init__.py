"""The commands of ``doe``. They import methods inside their functions, so that help comes at once.

- ``functions``: those that are functions of ``doe.library``, where a study stands, and the meaning of keys
- ``new``: a new study with its limits, points of operation, tolerances and dimension chains
"""
