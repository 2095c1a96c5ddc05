"""Motions over time, on request, and what is made of them.

- ``history``: every motion and contact, and life by ISO/TS 16281 with the loads that each roller saw
- ``orbit``: whirl of the cage; ``lyapunov``: how fast neighbours part
"""
