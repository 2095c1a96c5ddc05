"""From batches to figures with errors.

- ``metrics``: impact force, whirl deviation ratio, power loss, cage speed of replicates
- ``filtered_whirl``: speed of the cage's centre below a cutoff, of runs and of rigs
- ``batch_means``: scatter; ``drift``: transient and slow change; ``bias``: time integration
- ``error_bars``: all of them joined, and what is to be said of them
"""
