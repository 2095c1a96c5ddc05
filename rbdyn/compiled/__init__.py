"""Compilation of kernels.

- ``kernel``: kernels, laws by type, entry points; their machine code on disk, verified before use
- ``parts``: a compiler of kernels from numba's internal parts; stock numba replaces it where these changed
- ``elementary``: exponentials, logarithms, roots and angles that vectorise, with their errors
"""
