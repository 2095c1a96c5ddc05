"""Time stepping with error control; compiled.

- ``advance``: the loop over steps; ``method_laws``: what it asks of a method; ``records``: what it is given, carries and
  keeps; ``step_control``: how long the next step is; ``booking``: what is kept of a step
- ``runge_kutta``: the explicit pairs, which also see when stability holds the steps; ``dormand_prince``: that of order 5(4);
  ``kutta_pair``: Kutta's 3/8 rule; ``embedded_pair``: what it asks of either; ``orbit_frame``: where rollers are integrated
- ``rosenbrock``: RODAS4 for scenes where it pays, on ``jacobian`` and ``arrow_matrix``; ``implicit`` makes its storage
- ``method``: which of them integrates a scene
"""
