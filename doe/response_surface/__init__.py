"""Response surfaces: least-squares polynomials with the statistics to judge them.

- ``surface`` fits, predicts, and says in sentences what the statistics mean; ``least_squares`` checks the runs and solves
- ``anova``, ``model_error``, ``canonical``, ``box_cox`` judge; ``comparison``: against a Gaussian process
"""

from doe.designs.model import model_matrix
from doe.response_surface.surface import Surface, describe, fit
