"""Designs of experiments in coded units, one column a factor; ``coding`` turns them into actual ones.

- ``central_composite`` (on ``cube``), ``box_behnken``, ``grids``: the designs, each a ``design.Design``
- ``evaluation`` (on ``model`` and ``region``): what a design can tell before any run is made
"""

from doe.designs.box_behnken import box_behnken
from doe.designs.central_composite import axial_distance, central_composite
from doe.designs.coding import to_actual, to_coded
from doe.designs.design import Design
from doe.designs.grids import full_factorial, latin_hypercube, sobol
