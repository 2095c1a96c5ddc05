"""From batches to figures with errors.

- ``metrics``: figures of replicates, orbit of the cage, numerical error by companions, filtered whirl of runs and rigs
- ``batch_means``: statistical error of correlated series
- ``error_bars``: both errors together with transient and slow change, and the notes on them
"""
