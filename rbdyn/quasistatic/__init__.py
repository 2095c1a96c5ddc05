"""Ball bearings in equilibrium, after Jones and Harris: contact angles, loads, stiffness, runout, preload and life.

Where an equation stands: ``row`` (geometry of a row of balls), ``control`` (raceway control hypotheses), ``ball_motion``
(orbit, spin, centrifugal force, gyroscopic moment), ``ball`` (forces on one ball and their derivatives), ``ring``
(forces on the inner ring, balls eliminated), ``start`` (first guess), ``newton`` (convex start and full equations),
``equilibrium`` (what Python calls), ``preload`` (least stress and longest life), ``life`` (fatigue from ball loads),
``rating`` (ISO 281 and ISO 76 from dimensions). Of the turning ring:
``race_errors`` (form errors of grooves and balls, as each ball meets them), ``walk`` and ``turn`` (equilibrium step by step),
``roundness`` and ``runout`` (measures of the path), ``runout_class`` (limits by tolerance class), ``linear_runout`` and
``runout_lots`` (small errors in proportion, many bearings at once), ``tolerance_design`` (race errors that meet a class). Two
rows with a floating ring between: ``double_decker`` (equilibrium), ``speed_split`` (speed of the middle ring).
``ring_growth`` (rotation, fits and heat of the rings). Rivals of the convex solver: ``full_system`` (all equations, dense),
``elimination``, ``plain_newton``, ``minpack``, ``levenberg_marquardt`` and ``finite_search`` (Hu et al. 2021), ``limited``
(ours, stopped early), ``solvers`` (by name), ``battery`` (random scenes for all). From scenes: ``model``, ``growth_model``, ``double_decker_model``,
``runout_model``; ``bearing`` puts all together. Over keys of a scene: ``sweep``, its points (``sweep_points``), compiled loop
(``sweep_march``), figures (``sweep_figures``), what to beware of (``remarks``) and result (``sweep_result``).

x is radial along the load, z axial; ball j stands at psi_j = 2 pi j/Z from x. The inner ring moves, the outer ring is
the reference. In the plane of a ball the centre of curvature of the outer groove is the origin, places are (axial,
radial), and a contact angle is atan2(axial, radial) of the line through both centres.
"""
