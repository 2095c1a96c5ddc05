"""Two rows with a floating ring between: ``equilibrium``, and ``model`` from a scene, with the speed of the middle ring."""
