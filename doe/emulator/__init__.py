"""Emulators of noisy simulations: a trend plus a Gaussian process, fitted by scikit-learn; knows no bearing.

- ``emulator``: fit, prediction, leave-one-out, random functions of the posterior; variances of few replicates, pooled
- ``regression``: kernels, prior and search of the hyperparameters; the only module that loads scikit-learn
"""

from doe.emulator.emulator import (
    Draws,
    Emulator,
    Hyperparameters,
    NoisyValues,
    fit_emulator,
    leave_one_out,
    pooled_variances,
)
