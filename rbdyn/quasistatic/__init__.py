"""Ball bearings in equilibrium, after Jones and Harris: contact angles, loads, stiffness, runout, preload and life.

- ``bearing``: ``equilibrium`` of a scene, with its solvers by name; ``result``: reports with life, remarks, figures
- ``row``: one row of balls, its forces and its convex solver; ``double_decker``: two rows with a floating ring between
- ``full_system``: all equations at once; ``finite_search``: the search of Hu et al. 2021
- ``sweep``: equilibria over keys of a scene; ``preload``: preload for least stress and for longest life
- ``runout``: form errors, the path of the turning ring, its measures, tolerance classes
- ``temperatures``: a single row at the temperatures that its friction keeps up, its heat and how that leaves; ``start``: how a cold
  row comes to them

x is radial along the load, z axial; ball j is at the azimuth psi_j = 2 pi j/Z from x. The inner ring moves, the outer ring
is the reference. In the plane of a ball the origin is the centre of curvature of the outer groove, and positions are
(axial, radial). A contact angle is atan2(axial, radial) of the line through both groove centres.
"""
