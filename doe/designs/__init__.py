"""Designs of experiments in coded units, one column a factor.

- ``central_composite``, ``three_levels``, ``grids``, ``optimal``: the designs, each a ``design.Design``, which knows units
- ``evaluation`` (on ``model``): what a design can tell before any run is made
"""

from doe.designs.central_composite import axial_distance, central_composite
from doe.designs.design import Design, to_actual, to_coded
from doe.designs.grids import full_factorial, latin_hypercube, sobol
from doe.designs.optimal import optimal
from doe.designs.three_levels import box_behnken, definitive_screening
