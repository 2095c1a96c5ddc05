"""Unknown inputs: what is not known of a scene, and what it does to an answer. Methods on tables; knows no bearing.

- ``laws``: distributions of inputs and their dependence
- ``plan``: nested input sets
- ``screening``: which of many inputs matter
- ``spread``: what an output ranges over, and how much of that is noise
- ``sensitivity``: which input makes it
"""
