"""Verdict on a cage from its orbit; it knows no bearing.

- ``orbits``: measures of an orbit and its class, share of each class among bearings alike, and the verdict
"""
