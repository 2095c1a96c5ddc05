"""Where a user's programs keep what they can make anew."""

import os
from pathlib import Path


def user_cache() -> Path | None:
    """``XDG_CACHE_HOME``, else ``.cache`` in the user's home; None where there is no home."""
    if folder := os.environ.get("XDG_CACHE_HOME"):
        return Path(folder).absolute()
    try:
        return Path.home() / ".cache"
    except RuntimeError:
        return None
