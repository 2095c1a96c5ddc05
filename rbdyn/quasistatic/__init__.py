"""Ball bearings in equilibrium, after Jones and Harris: contact angles, loads, stiffness, runout, preload and life.

- ``row``: one row of balls, its forces and its solver; ``double_decker``: two rows with a floating ring between
- ``bearing``: what ``rbdyn.equilibrium`` calls, solvers by name; ``result``: what is reported, with life, and what to beware of
- ``rivals``: solvers compared with ours
- ``preload``: the preload for least stress and for longest life
- ``runout``: form errors, the turning ring, classes; ``sweep``: equilibria over keys of a scene

x is radial along the load, z axial; ball j stands at psi_j = 2 pi j/Z from x. The inner ring moves, the outer ring is
the reference. In the plane of a ball the centre of curvature of the outer groove is the origin, places are (axial,
radial), and a contact angle is atan2(axial, radial) of the line through both centres.
"""
