"""Ground floor of both packages; knows no bearing.

- ``faults``: errors that say how to fix them; ``fields``: keys with units; ``arrays``
- ``records``: results as JSON, tables and CSV; ``storage``: finished parts on disk; ``cache``: digests and the user's folder; ``sources``: the code they depend on
- ``words``: how values, errors and counts are written; ``blocks``, ``render``: what is said, and its renderings
- ``loading``, ``streams``, ``terminal``, ``options``, ``ranges``: what commands share; ``forecast``: how long runs take
"""
