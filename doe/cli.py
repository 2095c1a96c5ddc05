"""The command ``doe``."""

from rbdyn.base.loading import Loading

with Loading():
    from doe.commands.functions import calibrate, chain, design, fit, front, keys, status, study, uncertainty
    from doe.commands.functions import run as run_table
    from doe.commands.new import new
    from rbdyn.base import streams
    from rbdyn.base.command import Program, Version

app = Program()

for command in (new, study, status, design, fit, front, uncertainty, calibrate, chain, run_table, keys):
    app.command()(command)


@app.callback()
def main(version: Version = False) -> None:
    """Designed experiments on a bearing: from clearances to part dimensions with tolerances."""


def run() -> None:
    """Entry point of the command."""
    streams.run(app)
