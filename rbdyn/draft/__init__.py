"""Drafts of scenes: a commented scene of a bearing, whose interior is estimated where no drawing states it.

- ``text``: the scene of a designation, a drawing of one's own or a REXS file, from the templates in this folder
- ``options``: the table of what a user may state; ``values``: what fills a template
"""
