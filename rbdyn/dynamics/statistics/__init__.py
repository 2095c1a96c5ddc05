"""From batches to figures with errors.

- ``replicate``: one run in batches; ``metrics``: figures with their errors, numerical error by companions, filtered whirl
- ``extremes``: return force of impacts by Gumbel's law
- ``batch_means``: statistical error of correlated series
- ``error_bars``: both errors together with transient and slow change, and the notes on them
"""
