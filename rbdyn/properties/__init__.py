"""Properties by name: ``materials`` (elastic constants, density, expansion), ``lubricants`` (an oil, and jet oils over temperature),
``oils`` (grades and data sheets); bearings by name: ``designation`` (kind, size, suffixes), ``catalogue`` (what is inside),
``cages`` (the cage's section and volume)."""
