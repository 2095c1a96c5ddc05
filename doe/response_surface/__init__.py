"""Response surfaces: least-squares polynomials with the statistics to judge them.

``surface`` fits and predicts; ``least_squares`` solves, ``anova``, ``canonical``, ``diagnostics`` and
``model_error`` judge, ``words`` says it in sentences.
"""

from doe.designs.model import model_matrix
from doe.response_surface.surface import Surface, fit
from doe.response_surface.words import describe
