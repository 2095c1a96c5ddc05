"""The adaptive search with few candidates, levels and drawn fronts, for tests of what surrounds it.

Its front is rough; its stages, budget, files and sentences are those of a whole one. What a search finds is the subject of
``test_adaptive``.
"""

from typing import Any

from doe.adaptive import emulators, search

FEWER: tuple[tuple[Any, dict[str, int]], ...] = (
    (emulators, {"EVERYWHERE": 7, "CHILDREN": 32}),
    (emulators, {"LEVELS": 10, "MOST_LEVELS": 200}),
    (search, {"FRONT_DRAWS": 8, "ROUNDS": 1, "SHOWN": 50, "FEW": 256}),
)


def coarsely(patch: Any) -> None:
    """Let searches be coarse; ``patch(target, name, value)`` replaces an attribute, such as ``monkeypatch.setattr``."""
    for module, numbers in FEWER:
        for name, value in numbers.items():
            patch(module, name, value)
