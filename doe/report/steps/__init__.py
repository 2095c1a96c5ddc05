"""JSON and tables of each step: ``fit`` (with design and chain), ``front``, ``confirmation``, ``robust``, ``uncertainty``, ``calibrate``."""
