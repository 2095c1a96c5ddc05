"""Time stepping with error control; compiled.

- ``runge_kutta``: step control of the explicit pairs, which also sees when stability holds the steps;
  ``dormand_prince``: that of order 5(4); ``kutta_pair``: Kutta's 3/8 rule; ``embedded_pair``: what it asks of either
- ``orbit_frame``: the frame in which rollers are integrated; ``booking``: what is kept of a step
- ``rosenbrock``: RODAS4 for scenes where it pays, on ``jacobian`` and ``arrow_matrix``; ``implicit`` makes its storage
- ``method``: which of them integrates a scene
"""
