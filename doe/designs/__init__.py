"""Designs of experiments in coded units, one column a factor; ``coding`` turns them into actual ones."""

from doe.designs.central_composite import axial_distance, central_composite
from doe.designs.coding import to_actual, to_coded

__all__ = ["axial_distance", "central_composite", "to_actual", "to_coded"]
