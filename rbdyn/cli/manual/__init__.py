"""``rbdyn manual``: one page that opens from disk, made of prose and of what the source says of itself.

- ``prose``: the chapters in Markdown, in the order of their file names; those of a higher floor stand there
- ``part``: what a floor of the house adds; ``command``: the command, which asks the higher floors by an entry point
- ``reference``: keys and commands; ``docstrings``: equations and library; ``page``: all of it as HTML
"""
