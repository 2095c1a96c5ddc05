"""What a person sees of a study.

- ``sections``: what is said of each subject, as JSON and as ``rbdyn.base.blocks``
- ``page``: all sections as one HTML page, with its scripts and style in ``html``
- ``summary``: the record of a whole study, and its numbers for people
- ``files``: all that a study writes; ``still``: pictures for pages and files
"""
