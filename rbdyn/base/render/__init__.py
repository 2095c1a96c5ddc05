"""One tree of blocks, rendered three times: ``terminal``, ``markdown``, ``html``."""
