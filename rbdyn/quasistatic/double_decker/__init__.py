"""Two rows with a floating ring between: ``equilibrium``, ``speed_split`` (speed of the middle ring), ``model`` (from a scene)."""
