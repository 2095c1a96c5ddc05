"""Contact laws that rollers and balls share.

- ``hertz_line``: load of a line contact against approach (Palmgren), whole, in slices, on an elastic bar
- ``damping``: what a closing or opening contact adds to the elastic load
- ``traction``: friction coefficient against sliding speed
- ``film``: rolling resistance of the lubricated line contact; the short-journal film

Conventions: approach is positive when surfaces overlap, its rate positive when they close, loads are
non-negative. A slip is the surface speed of the ring (or cage) minus that of the roller; the traction on the
roller points along the slip. All SI.
"""
