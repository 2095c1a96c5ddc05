"""What a person sees of a study.

- ``steps``: JSON and tables of each step; ``study``: of a whole study, its answer, files and pictures
- ``sections``: what the report says, as ``rbdyn.base.blocks``; ``html``, ``markdown``: both its files
- ``still``: pictures that matplotlib draws for the page and for files
- ``words``: names and numbers for people
"""
