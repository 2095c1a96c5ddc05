"""Studies of ball bearings: ``solvers`` beside each other, ``battery`` over the random bearings of ``cases``; ``pictures``."""
