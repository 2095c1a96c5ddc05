"""What a report says, as blocks that terminal, Markdown and HTML render.

- ``record``: reading of summary.json, any part of which may be missing
- ``answer``, ``experiments``, ``fits``, ``fronts``, ``parts``, ``bearing``, ``contents``: the sections, in this order
- ``plot``: pictures of the front that scripts mark points in
"""

from doe.report.sections.contents import sections
