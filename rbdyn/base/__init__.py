"""The ground floor of both packages: what a result says, and how it is written. Knows no physics and no command.

- ``blocks``: the tree that a result becomes
- ``render``: the tree on a terminal, as Markdown and as HTML
"""
