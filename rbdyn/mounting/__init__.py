"""What mounting, heat and rotation do to clearances.

- ``rings``: growth of a ring by fit, rotation and temperature; ``fits``: the operating clearance of a roller bearing
- ``ring_growth``: growth of the grooves of a row of balls; ``ball_rings``: the same from a scene
"""
