"""Designed experiments: design, response surface, Pareto front, dimension chain, and the study that joins them.

- ``designs``, ``response_surface``, ``pareto``, ``dimension_chain``: methods that know no bearing
- ``study_file``: STUDY.toml, checked
- ``running``: where points run and how they are kept
- ``clearance``: the bearing study; the only module that runs bearing simulations
- ``workflow``: design, runs, surfaces, front, confirmation, chains in one go, finished runs kept on disk
- ``report``: what a person sees; ``commands``: the command ``doe``
"""
