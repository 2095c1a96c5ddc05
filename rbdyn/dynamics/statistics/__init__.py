"""From batches to figures with errors.

- ``metrics``: impact force, whirl deviation ratio, power loss, cage speed and orbit of replicates; error of the time integration
- ``filtered_whirl``: speed of the cage's centre below a cutoff, of runs and of rigs
- ``batch_means``: scatter
- ``error_bars``: scatter, transient, slow change and integration joined, and what is to be said of them
"""
