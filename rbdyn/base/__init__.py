"""The ground floor of both packages: what a result says, and how it is written. Knows no physics and no command.

- ``words``: names and numbers for people, a value with its error
- ``ranges``: lists of numbers as they are typed
- ``blocks``: the tree that a result becomes
- ``render``: the tree on a terminal, as Markdown and as HTML
"""
