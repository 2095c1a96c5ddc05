"""The command ``rbdyn``. Physics is imported inside the commands, so that help comes at once.

- ``app``: simulate, map, accuracy, show; ``ball``: the command of ball bearings, its output (``ball_output``), studies
  (``ball_studies``) and sweeps (``ball_sweep``); ``keys``: what every key of an input file means
- ``manual``: keys, commands, equations and the prose between them as one page
- ``new``: a scene of a catalogue bearing, from ``new_scene`` and a ``template``
- ``options``, ``ranges``: arguments that several commands share, lists of numbers as they are typed
- ``terminal``: exit codes, messages, output folders, progress (``remaining``: time left), for ``doe`` too; ``streams``, ``loading``: streams that
  close and Ctrl-C, at any moment
"""

from rbdyn.base.loading import Loading


def run() -> None:
    """Entry point of the command."""
    with Loading():
        from rbdyn.base import streams
        from rbdyn.cli.app import app
    streams.run(app)
