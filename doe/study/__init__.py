"""The study that joins the steps.

- ``design``: the points of the study and what they can tell
- ``runs``, ``store``: design runs, kept as they end
- ``surfaces``, ``front``, ``confirmation``: from runs to a confirmed pick
- ``reference``: a published table beside
- ``whole``: all of it in one go
"""

from doe.study.whole import Outcome, run_study

__all__ = ["Outcome", "run_study"]
