"""How code is compiled here.

- ``kernel``: kernels, laws chosen by type, entry points
- ``cache``: machine code of entry points on disk, checked before it is used
- ``elementary``: exponentials, logarithms, roots and angles that vectorise, with their errors
- ``sources``: on which source code compiled code and stored runs depend
"""
