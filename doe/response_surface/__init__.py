"""Response surfaces: least-squares polynomials with the statistics to judge them.

- ``surface``: fit and prediction, and their cross-validation with a Gaussian process
- ``statistics``: what is known of a fit, its stationary point and curvature, and sentences on them
- ``least_squares``: runs of a response, their checks, the solution, and power transforms of Box and Cox
- ``adequacy``: analysis of variance, elimination, residual diagnostics, known variances, model error
"""

from doe.designs.model import model_matrix
from doe.response_surface.statistics import describe
from doe.response_surface.surface import Surface, cross_validate, fit
