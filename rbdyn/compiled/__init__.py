"""How code is compiled here.

- ``kernel``: kernels, laws chosen by type, entry points; their machine code on disk, checked before it is used
- ``parts``: a compiler of kernels made of numba's inner parts, which stock numba replaces where they changed
- ``elementary``: exponentials, logarithms, roots and angles that vectorise, with their errors
"""
