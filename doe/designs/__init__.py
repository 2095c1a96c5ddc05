"""Designs of experiments in coded units, one column a factor.

- ``design``: the record of a design, and the designs that are constructed; ``optimal``: those that are searched for
- ``evaluation`` (on ``model``): how good a design is before any run is made
"""

from doe.designs.design import (
    Design,
    axial_distance,
    box_behnken,
    central_composite,
    definitive_screening,
    full_factorial,
    latin_hypercube,
    sobol,
    to_actual,
    to_coded,
)
from doe.designs.optimal import optimal
