"""A whole study: ``answer`` (its text on the terminal), ``summary`` (summary.json, with what was ``asked``), ``files``, ``plots``."""
