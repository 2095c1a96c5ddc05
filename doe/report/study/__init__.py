"""A whole study: ``answer`` (its end on the terminal), ``summary`` (summary.json, with what was ``asked``), ``files``, ``plots``."""
