"""What a person sees of a study.

- ``steps``: JSON and tables of each step; ``study``: of a whole study, its files and pictures
- ``sections``: what the report says, as blocks; ``html``, ``markdown``: both its forms
- ``words``: names and numbers for people
"""
