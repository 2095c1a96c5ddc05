"""The command ``doe``."""

from rbdyn.base.loading import Loading

with Loading():
    import typer

    from doe.commands.calibrate import calibrate
    from doe.commands.chain import chain
    from doe.commands.design import design
    from doe.commands.fit import fit
    from doe.commands.front import front
    from doe.commands.keys import keys
    from doe.commands.new import new
    from doe.commands.status import status
    from doe.commands.study import study
    from doe.commands.uncertainty import uncertainty
    from rbdyn.base import streams
    from rbdyn.base.options import Version, refusing

app = typer.Typer(no_args_is_help=True, pretty_exceptions_enable=False)

for command in (new, status, design, fit, chain, uncertainty, calibrate, keys):
    app.command()(command)
former = refusing({"--direct": "run python examples/benchmarks/direct_front.py STUDY.toml --out DIR"})
app.command(cls=former)(study)
app.command(cls=former)(front)


@app.callback()
def main(version: Version = False) -> None:
    """Designed experiments on a bearing: from clearances to part dimensions with tolerances."""


def run() -> None:
    """Entry point of the command."""
    streams.run(app)
