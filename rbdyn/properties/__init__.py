"""Properties by name: ``materials`` (elastic constants, density, expansion), ``lubricants`` (an oil, and jet oils over temperature),
``oils`` (grades and data sheets); fits by name: ``iso286`` (shafts, housings), ``iso492`` (rings); bearings by name:
``designation`` (kind, size, suffixes), ``catalogue`` (what is inside), ``cages`` (the cage's section and volume)."""
