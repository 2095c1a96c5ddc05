"""Dimension chains as plain numbers."""

from collections.abc import Mapping
from typing import Any

from doe.dimension_chain import ChainResult


def chains_record(results: Mapping[str, ChainResult]) -> dict[str, Any]:
    """JSON of ``doe chain`` for a file of several chains."""
    refused = [name for name, result in results.items() if result.refused]
    status = f"refused: {', '.join(refused)}" if refused else "ok"
    return {"chains": {name: result.as_dict() for name, result in results.items()}, "status": status}
