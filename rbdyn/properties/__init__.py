"""Properties by name: ``materials`` (elastic constants, density, expansion) and ``lubricants`` (oils over temperature)."""
