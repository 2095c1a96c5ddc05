"""JSON and tables of each step: ``design``, ``fit``, ``front``, ``tolerance_aware``, ``confirmation``, ``chain``, ``status``."""
