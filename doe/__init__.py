"""Designed experiments: design, response surface, Pareto front, dimension chain, and the study that joins them.

- ``designs``, ``response_surface``, ``pareto``, ``emulator``, ``adaptive``, ``unknown``, ``dimension_chain``: methods that know
  no bearing
- ``study_file``: STUDY.toml, checked; ``running``: runs and their store
- ``clearance``: the bearing of a study; the only module that runs bearing simulations
- ``workflow``: the steps of a study and the whole of it; ``report``: what a person sees; ``commands``: the command ``doe``
"""
