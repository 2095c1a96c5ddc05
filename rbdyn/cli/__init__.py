"""The command ``rbdyn``. Physics is imported inside the commands, so that help comes at once.

- ``app``: simulate, map, accuracy; ``simulation_output``: what the first of them says and writes; ``show``: a run as pictures
- ``ball``: the command of ball bearings; ``ball_output``: an equilibrium; ``ball_studies``: its studies and sweeps
- ``keys``: what every key of a scene means
- ``manual``: keys, commands, equations and the prose between them as one page
- ``new``: the command; ``new_scene``: a scene of a catalogue bearing, from a template

What the commands of both packages share stands in ``rbdyn.base``.
"""

from rbdyn.base.loading import Loading


def run() -> None:
    """Entry point of the command."""
    with Loading():
        from rbdyn.base import streams
        from rbdyn.cli.app import app
    streams.run(app)
