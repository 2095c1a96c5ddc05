"""Runout of a turning ring.

- ``turn``: form errors of grooves and balls, and the path of the ring that turns over them, its measures and
  their limits by tolerance class
- ``lots``: path of a scene; runout of many bearings at once by a linear response, and race limits that meet a tolerance class
"""
