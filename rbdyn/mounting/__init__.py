"""What mounting, heat and rotation do to clearances.

- ``rings``: growth of a ring by fit, rotation and temperature, and of the grooves of balls
- ``cage``: clearances of a cage between growing parts
- ``fits``: both from a scene, for rollers and for balls
"""
