"""Designs of experiments in coded units, one column a factor.

- ``design``: the record of a design and the classical designs; ``optimal``: D- and I-optimal designs by search, and what remains of a region
  where runs failed
- ``model``: terms of a polynomial, and how well a design estimates them before any run
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
