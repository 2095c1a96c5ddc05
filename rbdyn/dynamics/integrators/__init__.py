"""Time stepping with error control; compiled.

- ``advance``: the loop over steps, their length and what is kept of them; ``method_laws``: what it asks of a method; ``records``: what
  it is given, carries and keeps
- ``runge_kutta``: the explicit pairs, in a frame that turns with the rollers, which also see when stability holds the steps;
  ``dormand_prince``: that of order 5(4); ``kutta_pair``: Kutta's 3/8 rule
- ``rosenbrock``: RODAS4 for scenes where it pays, with its Jacobian and arrow matrix; ``implicit`` makes its storage
- ``method``: which of them integrates a scene
"""
