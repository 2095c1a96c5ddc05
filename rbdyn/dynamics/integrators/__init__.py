"""Time stepping with error control; compiled code that knows no scene.

- ``advance``: the loop over steps, what it asks of a method, and the records it reads and fills
- ``runge_kutta``: Dormand and Prince's pair, in a frame that turns with the rollers; they also show when stability limits the steps
- ``verlet``: velocity Verlet with staggered traction coefficients, one right-hand side a step
- ``stopped_cage``: a cage that thick oil stops within a step of ``verlet``
- ``rosenbrock``: RODAS4 for scenes where it pays, with its Jacobian and arrow matrix
"""
