"""The commands of ``doe``. They import methods inside their functions, so that help comes at once.

- ``functions``: those that are functions of ``doe.library``, where a study stands, and the meaning of keys
- ``new``: a new study with its limits and points of operation; ``new_parts``: tolerances and dimension chains of the parts that
  make its clearances
"""
