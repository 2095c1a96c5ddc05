"""Contact laws that rollers and balls share.

- ``hertz_line``: load of a line contact against approach (Palmgren and rivals), whole, in slices, on an elastic bar
- ``hertz_point``: load of a point contact against approach, its ellipse and pressure (exact Hertz); ``static_limit``: dents
- ``cage_bar``: stiffness of a cross-bar of a window cage, in series with the contact on it
- ``profile``: roller profiles as drops over the length
- ``damping``: what a closing or opening contact adds to the elastic load; restitution
- ``traction``: friction coefficient against sliding speed and load, as compiled; ``tangential_elasticity``: bodies that give way first
- ``rheology``: traction of an elastohydrodynamic film from the oil's behaviour under pressure and shear
- ``film_thickness``: thickness of that film, its lambda ratio, the share that asperities bear
- ``point_film``: the same for the ellipse of a ball, and the film's stiffness
- ``rolling_resistance``: of the lubricated line contact, flooded or starved, and of films of contacts that are open
- ``cage_film``: the short-journal film of a guide land; wedge, squeeze and shear between a roller and a pocket wall

Conventions: approach is positive when surfaces overlap, its rate positive when they close, loads are
non-negative. A slip is the surface speed of the ring (or cage) minus that of the roller; the traction on the
roller points along the slip. All SI.
"""
