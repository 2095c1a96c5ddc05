"""JSON and tables of each step: ``design``, ``fit``, ``front``, ``confirmation``, ``chain``."""
