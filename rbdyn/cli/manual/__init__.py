"""``rbdyn manual``: one page that opens from disk, made of prose and of what the source says of itself.

- ``prose``: the chapters in Markdown, in the order of their file names; those of a higher floor stand there
- ``command``: the command, which asks the higher floors for their ``page.Part`` by an entry point
- ``docstrings``: equations and library; ``page``: keys, commands and all of it as HTML
"""
