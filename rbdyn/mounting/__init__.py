"""What mounting, heat and rotation do to clearances.

- ``rings``: growth of a ring by fit, rotation and temperature; ``cage``: clearances of a cage between growing parts
- ``fits``: the clearances of a roller bearing in operation, from a scene
- ``ring_growth``: growth of the grooves of a row of balls; ``ball_rings``: the same from a scene
"""
