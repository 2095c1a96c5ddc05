"""Response surfaces: least-squares polynomials with the statistics to judge them."""

from doe.response_surface.surface import Surface, describe, fit, model_matrix

__all__ = ["Surface", "describe", "fit", "model_matrix"]
