"""How code is compiled here.

- ``kernel``: kernels, laws chosen by type, entry points cached on disk
- ``elementary``: exponentials, logarithms, roots and angles that vectorise, with their errors
- ``sources``: on which source code compiled code and stored runs depend
"""
