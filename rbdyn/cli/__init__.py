"""The command ``rbdyn``. Physics is imported inside the commands, so that help comes at once.

- ``app``: simulate, map, accuracy and show; ``simulation_output``, ``show``: what simulate and show print and write
- ``compare``: two bearings; ``stiffness``: over speed, for programs of rotors
- ``ball``: the command of ball bearings; ``ball_studies``: its equilibria, studies and sweeps
- ``manual``: keys of a scene, and the manual as one page: keys, commands, equations and the prose between them
- ``new``: a scene of a catalogue bearing or of one's own

``rbdyn.base`` has what the commands of both packages share.
"""

from rbdyn.base.loading import Loading


def run() -> None:
    """Entry point of the command."""
    with Loading():
        from rbdyn.base import streams
        from rbdyn.cli.app import app
    streams.run(app)
