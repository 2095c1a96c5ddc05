"""``doe new``."""

import json
import math
import os
import re
import tempfile
import tomllib
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, NamedTuple

import typer

from rbdyn.base import command
from rbdyn.base.faults import InputError, MethodError
from rbdyn.base.tables.sheet import listed
from rbdyn.clearances import CLEARANCES

if TYPE_CHECKING:
    from doe.workflow.parts import ClearanceParts, Manufacture
    from doe.workflow.problem import Problem
    from rbdyn.scene import Scene
    from rbdyn.scene.duty import DutyPoint


RESOLUTION_MM, SMALLEST_STEP_MM = 0.001, 0.002
FACTOR = """[[factor]]
name = "{name}"
key = "{table}.{name}"
centre = {centre} # {source}
step = {step:.6g} # {width}
resolution = 0.001 # of the drawing
"""
BASELINE = """[baseline] # the design over which improvements count
{values}
"""
TOLERANCE = """tolerance = {half_width:.6g} # half width: {rule}
"""
HINT = """# Add to a factor: tolerance = 0.005, the half width that can be manufactured; then [front] tolerance_aware = "quantile" and
# [tolerances] count with it. A response may have limits: upper = 100.0. Chains of dimensions: [[chain]]."""
LIMIT = re.compile(r"\s*([^<>=\s]+)\s*(<=|>=|=)\s*([^<>=]+?)\s*")
CAGE_CLASS = "cage.verdict"
# Tolerance of design runs with elastic contacts: 13 to 22 % fewer right-hand sides than the default, and no bias that shows.
DESIGN_RTOL = 0.04
HELD = """# Cage: held in a short run of the scene, so its whirl ratio means little and the impact power is a goal instead.
# You can still name the whirl ratio: [[response]] with name = "whirl_deviation_ratio" and goal = "min".
"""
BOUNDS = {"<=": "upper", "=": "upper", ">=": "lower"}
POINT = """[[duty]]
name = {name}
share = {share!r} # {unit}
set = {set}{mark}
"""
SLOW = " # forgets its start later than the points that discard fewer turns"
# Of a study that derives its tolerances, whose chains are made to these.
DERIVED = "would state it. Default: as [tolerances] derives it, otherwise as the factor states it"
MARK = "estimated = true # until a drawing states it: parts and reports mark it\n"
# By name of the response, then "upper" or "lower".
Limits = dict[str, dict[str, float]]


class Factor(NamedTuple):
    """A clearance that a study varies: name, table of the scene, value and step [mm], and where these two come from."""

    name: str
    table: str
    centre: float
    step: float
    source: str
    width: str


def new(
    path: Annotated[Path, typer.Argument(metavar="SCENE.toml", help="Scene file whose clearances to study.")],
    limit: Annotated[
        list[str] | None,
        command.valued(
            "NAME<=V",
            'Limit a response, in quotes: "power_loss_W<=250", >= or = for <=; repeatable.',
            "none",
            "--limit",
        ),
    ] = None,
    tolerances: Annotated[
        bool,
        command.flag("--tolerances", help="Add tolerances of the clearances by ISO 286 grade, and the widest ones."),
    ] = False,
    chains: Annotated[bool, command.flag("--chains", help="Add the dimension chains of the parts.")] = False,
    duty: Annotated[
        Path | None,
        command.valued(
            "FILE",
            "Operating points of a duty cycle: CSV with name, share or hours, and keys; or TOML.",
            "the scene file's own",
            "--duty",
        ),
    ] = None,
    out: command.OutFile = None,
    force: command.ForceFile = False,
    as_json: command.Json = False,
) -> None:
    """Create a commented study file for the clearances of a scene file."""
    with command.guarded(as_json):
        from doe.study_file.study import StudyFile
        from doe.workflow import front, problem, region, whole
        from doe.workflow.confirmation import WHIRL
        from doe.workflow.effort import Effort
        from rbdyn.base.faults import read_toml, validated
        from rbdyn.scene import DrawnScene, rollers_only

        command.check_out(out, force, reads := [path, *([duty] if duty else [])])
        limits, class_limit = limits_of(limit or []), _class_limit(limit or [])
        scene = rollers_only(DrawnScene.load(path))
        points, hours = _duty(duty, scene)
        sections = {"responses": _responses(limits) + class_limit, "duty": duty_text(points, hours), "baseline": ""}
        factors = _factors(read_toml(path))
        values = {"quoted": _quoted_path(path, out), "hours": "true" if hours else None}

        def written(factors: list[Factor], discarded: int = region.DISCARDED) -> tuple[str, problem.Problem]:
            parts = _sections(scene, factors, tolerances, chains)
            text = _filled(parts | sections, values | _numerics(scene, discarded))
            file = validated(StudyFile, tomllib.loads(text), f"study of {path}")
            return text, problem.Problem(out or Path("study.toml"), file)

        text, study = written(factors)
        front.check_goals(study)
        with tempfile.TemporaryDirectory() as temporary:
            folder, effort = Path(temporary), Effort(notice=command.notice(False))
            moved = region.region_that_runs(study, folder, effort, kept=1.0).study
            if moved is not study:
                sections["baseline"], factors = _baseline(moved), _moved(factors, study, moved)
                text, study = written(factors)
            whole.check_study(study)
            cages = region.baseline_cages(study, folder, effort)
            if {cage.name for cage in cages.values()} == {"held"}:
                sections["responses"] = HELD + _responses(limits, {WHIRL: region.IMPACT_POWER}) + class_limit
                text, study = written(factors)
            if cages and len(slow := region.slow_points(study, folder, effort)) < len(cages):
                sections["duty"] = duty_text(points, hours, slow)
                text, study = written(factors, region.FEWER)
        whole.check_study(study)
        command.hand_out(text, as_json, out, force, "doe study", reads)


def _quoted_path(path: Path, out: Path | None) -> str:
    """Path of the scene in quotes, from the folder of the study ``out``, where it finds its scene."""
    return json.dumps(str(path if out is None else os.path.relpath(path.resolve(), out.resolve().parent)))


def _numerics(scene: "Scene", discarded: int) -> dict[str, str | None]:
    """What the template says of the turns that design runs discard, and of their tolerance.

    That is looser unless the scene has its own or may run implicitly. Confirmations keep the default of both.
    """
    from doe.workflow.region import DISCARDED

    looser, kept = "", [f"numerics.discard_turns={DISCARDED}"] * (discarded != DISCARDED)
    if scene.traction.elasticity and "rtol" not in scene.numerics.model_fields_set:
        looser, kept = f', "numerics.rtol={DESIGN_RTOL}"', [f"numerics.rtol={scene.numerics.rtol}", *kept]
    return {"discarded": str(discarded), "looser": looser, "kept": json.dumps(kept) if kept else None}


def limits_of(texts: Sequence[str]) -> Limits:
    """Limits by response, without that on the class of the cage. Raises InputError with all faults at once."""
    from doe.clearance import responses_of
    from rbdyn.base.faults import LONGEST_NAME, one_line, refuse
    from rbdyn.base.words import quantity

    limits: Limits = {}
    faults = []
    for text in texts:
        where, match = f"--limit {one_line(text, LONGEST_NAME)}", LIMIT.fullmatch(text)
        if match is None:
            faults.append(f'{where}: is not a limit; write "NAME<=VALUE" or "NAME>=VALUE" in quotes')
            continue
        name, sign, number = match.groups()
        if name == CAGE_CLASS:
            faults += [f'{where}: names classes; write "{CAGE_CLASS}=held|circling" in quotes'] * (sign != "=")
            continue
        if name not in (names := responses_of(heats=True)):
            faults.append(f"{where}: no response has that name; choose one of {listed(names)}")
            continue
        try:
            value = command.plain_number(number, quantity(name)[1])
        except MethodError as error:
            faults.append(f"{where}: {one_line(number, LONGEST_NAME)} {error}")
            continue
        bounds, bound = limits.setdefault(name, {}), BOUNDS[sign]
        if not math.isfinite(value):
            faults.append(f"{where}: {number} is not a finite number; write a plain number")
        elif bound in bounds:
            faults.append(f"{where}: {name} has the {bound} limit {bounds[bound]:g} already; keep one of them")
        else:
            bounds[bound] = value
    faults += [
        f"--limit {name}: the lower limit {bounds['lower']:g} is not below the upper limit {bounds['upper']:g}; swap or widen them"
        for name, bounds in limits.items()
        if len(bounds) == 2 and bounds["lower"] >= bounds["upper"]
    ]
    refuse(faults)
    return limits


def _class_limit(texts: Sequence[str]) -> str:
    """The limit on the class of the cage; empty without one. The check of the study reads the names of classes."""
    classes = [match[3] for text in texts if (match := LIMIT.fullmatch(text)) and match[1] == CAGE_CLASS]
    if len(classes) > 1:
        raise InputError(f"--limit {CAGE_CLASS}: is stated {len(classes)} times; keep one of them")
    return "\n".join(["\n[limits]", *(f"cage.verdict = {_quoted(text)}" for text in classes), ""]) if classes else ""


def _responses(limits: Limits, instead: Mapping[str, str] | None = None) -> str:
    """The responses that a study improves, some by another one ``instead``, and those that are watched because they have limits."""
    from rbdyn.dynamics.figures import FIGURES

    keys = (figure.key for figure in FIGURES if figure.judged == "target")
    improved = dict.fromkeys(((instead or {}).get(key, key) for key in keys), 'goal = "min"')
    goals = dict.fromkeys(limits, 'goal = "none" # watched, with its limits only') | improved
    return "\n".join(_response(name, limits.get(name, {}), goals[name]) for name in improved | goals)


def _response(name: str, limits: Mapping[str, float], goal: str) -> str:
    bounds = [f"{bound} = {value!r}" for bound, value in limits.items()]
    return "\n".join(["[[response]]", f'name = "{name}"', *bounds, 'model = "quadratic"', goal, ""])


def _sections(scene: "Scene", factors: list[Factor], tolerances: bool, chains: bool) -> dict[str, str]:
    """Factors of the study, and what it says of their parts."""
    if not tolerances and not chains:
        return {"factors": "\n".join(map(_factor_text, factors)), "parts": HINT}
    from doe.workflow.parts import clearance_parts, manufacture_of

    groups = clearance_parts(scene)
    manufactures = {factor.name: manufacture_of(groups[factor.name], factor.step) for factor in factors}
    closing = [_chain_text(groups[name], manufacture, tolerances) for name, manufacture in manufactures.items()]
    return {
        "factors": "\n".join(
            _factor_text(factor, manufactures[factor.name] if tolerances else None) for factor in factors
        ),
        "parts": "\n".join([*[_template("tolerances")] * tolerances, *closing * chains]).rstrip(),
    }


def _template(part: str = "") -> str:
    """The template of a study, or a ``part`` of it."""
    return Path(__file__).with_name(f"new_study{part and '_'}{part}.toml").read_text(encoding="utf-8")


def _filled(sections: Mapping[str, str], values: Mapping[str, str | None]) -> str:
    """The template of a study with its sections and values."""
    text = _template()
    for name, section in sections.items():
        text = text.replace(f"{{{name}}}", section)
    return command.fill_template(text, values)


def _chain_text(group: "ClearanceParts", manufacture: "Manufacture", derived: bool) -> str:
    """A [[chain]] of a study: its links resolve to the clearance of the scene.

    ``derived``: the study derives the widest tolerances, to which the parts are made; so the chain states none itself.
    """
    rule, stated = (DERIVED, "# ") if derived else (manufacture.rule, "")
    head = _template("chain").format(**group._asdict(), half_width=manufacture.half_width, rule=rule, stated=stated)
    below = {"half_width": manufacture.rollers, "half_width_below": -manufacture.rollers}
    links = [
        _template("roller" if part.graded else "part").format(
            **part._asdict(), **below, mark=MARK if part.estimated else ""
        )
        for part in group.parts
    ]
    return "".join([head, *links])


def _duty(path: Path | None, scene: "Scene") -> "tuple[list[DutyPoint], bool]":
    """The duty of the study, and whether its shares are hours; empty without a file of its points. Raises InputError."""
    if path is None:
        return [], False
    from rbdyn.scene.duty import duty_scenes, in_hours, read_duty

    points = read_duty(path)
    duty_scenes(scene, points, str(path))
    return points, in_hours(points)


def _quoted(value: str | list[str]) -> str:
    """A value in TOML, without the characters that have a meaning in a template."""
    text = json.dumps(value, ensure_ascii=False)
    return "".join(f"\\u{ord(character):04x}" if character in "{}#" else character for character in text)


def duty_text(points: "Sequence[DutyPoint]", hours: bool, slow: Sequence[str] = ()) -> str:
    """The [[duty]] tables of a study; ``hours``: whether shares are hours; ``slow``: points that discard more turns than the others."""
    from doe.workflow.region import DISCARDED

    unit, more = "h" if hours else "of the time", [f"numerics.discard_turns={DISCARDED}"]
    return "\n".join(
        POINT.format(
            name=_quoted(point.name),
            share=point.share,
            unit=unit,
            set=_quoted([*point.set, *(more if point.name in slow else [])]),
            mark=SLOW if point.name in slow else "",
        )
        for point in points
    )


def _factor_text(factor: Factor, manufacture: "Manufacture | None" = None) -> str:
    text = FACTOR.format(**factor._asdict())
    return (
        text
        if manufacture is None
        else text + TOLERANCE.format(half_width=manufacture.half_width, rule=manufacture.rule)
    )


def _factors(scene: dict[str, Any]) -> list[Factor]:
    """A factor a clearance that the scene's file gives and that something reads."""
    landless = scene["cage"]["guidance"] == "roller" or scene.get("model", {}).get("guide_land") == "off"
    factors = []
    for clearance in CLEARANCES:
        table, _, name = clearance.key.partition(".")
        centre = scene[table].get(name)
        if centre is None or (landless and name == "guide_clearance_mm"):
            continue
        step = max(round(clearance.step * abs(centre) / RESOLUTION_MM) * RESOLUTION_MM, SMALLEST_STEP_MM)
        width = f"{100.0 * clearance.step:g} % of it"
        factors.append(Factor(name, table, float(centre), step, "value in the scene file", width))
    return factors


def _moved(factors: list[Factor], before: "Problem", after: "Problem") -> list[Factor]:
    """The factors with the region of the study ``after`` it moved."""
    moved = []
    for factor, old, new in zip(factors, before.file.factor, after.file.factor, strict=True):
        source = f"the scene has {factor.centre:g}: moved to where the bearing runs"
        changed = factor._replace(centre=new.centre, step=new.step, source=source)
        moved.append(factor if new == old else changed)
    return moved


def _baseline(study: "Problem") -> str:
    """The table of a baseline that is not the centre of the region."""
    values = "\n".join(f"{name} = {value!r}" for name, value in study.file.baseline.items())
    return BASELINE.format(values=values) if (study.baseline != study.centre).any() else ""
