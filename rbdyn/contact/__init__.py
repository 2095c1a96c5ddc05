"""Contact laws that rollers and balls share.

- ``hertz_line``: load of a line contact against approach (Palmgren and other laws), whole, in slices, on an elastic bar
- ``point_contact``: load of a ball against approach, its ellipse and pressure (exact Hertz), and its oil film
- ``cage_bar``: stiffness of a cross-bar of a window cage, in series with the contact on it
- ``profile``: roller profiles as drops over the length
- ``damping``: normal damping of a closing or opening contact; restitution
- ``traction``: friction coefficient against sliding speed and load, as compiled
- ``tangential``: the elasticity of the bodies, through which traction follows that coefficient
- ``film_thickness``: of the oil film of a line contact, its lambda ratio, the load share of asperities
- ``rheology``: traction of that film by the oil's behaviour under pressure and shear
- ``rolling_resistance``: of the lubricated line contact, flooded or starved, and of the films of open contacts
- ``cage_film``: the short-journal film of a guide land; wedge, squeeze and shear between a roller and a pocket wall

Conventions: approach is positive when surfaces overlap, its rate positive when they close, loads are
non-negative. A slip is the surface speed of the ring (or cage) minus that of the roller; the traction on the
roller points along the slip. All SI.
"""
