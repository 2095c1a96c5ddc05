"""Effect of mounting, temperature and rotation on clearances.

- ``rings``: growth of rings and of the grooves of balls by fits, rotation and temperature
- ``cage``: clearances of a cage between growing parts

``rbdyn.scene.fits`` takes both from a scene.
"""
