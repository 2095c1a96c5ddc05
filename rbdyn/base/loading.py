"""Ctrl-C while a command still loads. Loads nothing itself, so that it acts as early as possible."""

import _signal  # type: ignore[import-not-found]  # ``signal`` creates enumerations, which takes long
import os

INTERRUPTED = 130


class Loading:
    """Context in which Ctrl-C ends the process at once: nothing needs saving yet, and imports may swallow an exception."""

    def __enter__(self) -> None:
        self.ours = _signal.getsignal(_signal.SIGINT) is _signal.default_int_handler
        try:
            if self.ours:
                _signal.signal(_signal.SIGINT, lambda number, frame: os._exit(INTERRUPTED))
        except ValueError:
            self.ours = False  # only the main thread may handle signals

    def __exit__(self, *error: object) -> None:
        if self.ours:
            _signal.signal(_signal.SIGINT, _signal.default_int_handler)
