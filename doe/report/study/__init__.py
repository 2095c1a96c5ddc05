"""A whole study: ``summary`` (its text on the terminal; summary.json, with what was asked), ``files``, ``plots``."""
