"""Options of all commands: each has a help text, and help tells its default."""

import json
import re
from pathlib import Path

import pytest
import typer.main
from rich.text import Text
from typer.testing import CliRunner

from doe.cli import app as doe_app
from rbdyn.cli import ball_studies
from rbdyn.cli.app import app as rbdyn_app

EXAMPLES = Path(__file__).parents[2] / "examples"
APPS = {"rbdyn": rbdyn_app, "doe": doe_app}
OPTIONS = [
    pytest.param(app, command, option, id=f"{name} {command} {option.name}")
    for name, app in APPS.items()
    for command, known in typer.main.get_command(app).commands.items()
    for option in known.params
]


@pytest.mark.parametrize(("app", "command", "option"), OPTIONS)
def test_every_option_has_help_and_tells_its_default(app, command, option):
    """Command line: one that takes a value says what holds without it, in words where there is no plain value."""
    assert option.help and option.help.endswith((".", ".)"))
    # Help is rich text, which swallows what stands in square brackets.
    assert not re.search(r"\[\w+\.\w+\]", option.help)
    if option.param_type_name == "option" and not option.is_flag and not option.required:
        assert option.default is not None or isinstance(option.show_default, str), option.name


@pytest.mark.parametrize("name", APPS)
def test_help_shows_all_that_is_written_in_it(name):
    """Command line: no text of a command or option is swallowed as a tag of rich text."""
    for command, known in typer.main.get_command(APPS[name]).commands.items():
        for text in (known.help, *(option.help for option in known.params)):
            assert Text.from_markup(text).plain == text, f"{name} {command}"


@pytest.mark.parametrize("width", ["80", "120"])
def test_chains_in_one_file_are_named_in_the_help(monkeypatch, width):
    monkeypatch.setenv("COLUMNS", width)
    printed = " ".join(re.sub("[│─]", "", CliRunner().invoke(doe_app, ["chain", "--help"]).output).split())
    assert "or several in tables named chain." in printed and "[]" not in printed


# Commands in the order in which a user needs them, and the verbs that they begin with.
ORDER = {
    "rbdyn": "new simulate show map ball compare accuracy keys manual",
    "doe": "new study status design fit front uncertainty calibrate chain run keys",
}
VERBS = "Calculate|Compare|Create|Estimate|Explain|Find|Fit|Map|Print|Run|Show|Simulate|Solve|Vary|Write"
LONGEST_HELP = 20


@pytest.mark.parametrize("name", APPS)
def test_help_is_short_and_says_what_to_do(name):
    """Command line: commands come in the order of their use and begin with a verb; no help has more than 20 words or leans on another."""
    commands = typer.main.get_command(APPS[name]).commands
    assert " ".join(commands) == ORDER[name]
    for command, known in commands.items():
        assert re.match(rf"(?:{VERBS})\b", known.help), command
        for text in (known.help, *(option.help for option in known.params)):
            assert len(re.findall(r"\S*[A-Za-z]\S*", text)) <= LONGEST_HELP, f"{name} {command}: {text}"
            assert not re.search(r"instead\.|one's own|\b(?:the same|also)\b", text, re.IGNORECASE), (
                f"{name} {command}: {text}"
            )


def test_flags_show_no_value():
    """Command line: an option without a value is listed without the type of one."""
    printed = (
        CliRunner().invoke(rbdyn_app, ["simulate", "--help"]).output + CliRunner().invoke(doe_app, ["--help"]).output
    )
    assert "--install-completion" in printed and "bool" not in printed


def test_defaults_stand_in_the_help_as_printed(monkeypatch):
    monkeypatch.setenv("COLUMNS", "200")
    printed = CliRunner().invoke(rbdyn_app, ["simulate", "--help"]).output
    assert "[default: numerics.turns of the scene]" in printed and "[default: all processors]" in printed
    assert "[default: STUDY_results]" in CliRunner().invoke(doe_app, ["study", "--help"]).output


@pytest.mark.parametrize(
    ("options", "code", "words"),
    [((), 2, "--seed 3: no random numbers are used here"), (("--race-limits", "P4"), 0, '"seed": 3')],
)
def test_balls_are_drawn_by_a_seed_of_the_command(monkeypatch, options, code, words):
    monkeypatch.setattr(ball_studies, "SOLVED", 5)  # bearings in place of 100
    scene = str(EXAMPLES / "angular_contact_ball.toml")
    axial = [each for key in ("bearing.bore_mm=40.0", "operation.radial_load_N=0.0") for each in ("--set", key)]
    shown = CliRunner().invoke(rbdyn_app, ["ball", scene, *axial, *options, "--seed", "3", "--json"])
    assert shown.exit_code == code and words in shown.stdout, shown.output
    assert code or json.loads(shown.stdout)["class"] == "P4"
