"""What a person sees of a study.

- ``design``, ``fit``, ``front``, ``chain``: JSON and tables of each step
- ``answer``: the end of a study on the terminal
- ``summary``: summary.json, everything found
- ``files``: all files of a study; ``plots`` draws the pictures
- ``html``, ``markdown``: the report, both made of the blocks of ``content``; ``words``: names and numbers for people
"""
