"""Effect of mounting, temperature and rotation on clearances.

- ``rings``: growth of rings and of the grooves of balls by fits, rotation and temperature
- ``cage``: clearances of a cage between growing parts
- ``fits``: both from a scene, for rollers and for balls
"""
