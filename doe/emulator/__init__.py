"""Emulators of noisy simulations: a trend plus a Gaussian process, in numpy alone; knows no bearing.

- ``covariance``: the Matern correlation with its derivatives, and random functions that have it
- ``likelihood``: the restricted likelihood of the hyperparameters with its gradient
- ``emulator``: fit, prediction, leave-one-out, draws of whole functions
- ``scatter``: variances of few replicates, smoothed over the inputs
"""

from doe.emulator.emulator import Draws, Emulator, fit_emulator
from doe.emulator.scatter import pooled_variances
