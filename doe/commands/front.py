"""``doe front``."""

from typing import TYPE_CHECKING, Annotated, Any

from doe.commands.options import Data, Out, Quiet, Retry, Scheduler, StudyPath
from doe.commands.steps import Effort, fitted, keeping_runs, save
from rbdyn.base.blocks import Block, Detail
from rbdyn.base.faults import InputError, refuse
from rbdyn.base.options import Json, Workers, flag, valued
from rbdyn.base.render.terminal import show
from rbdyn.base.terminal import guarded, hand_over

if TYPE_CHECKING:
    from doe.study_file import Study

Point = Annotated[
    str | None,
    valued(
        "A,B,...|NAME=A,...",
        "Also what the surfaces say of this point: factor values in order, or by name (the rest at the baseline).",
        "none",
    ),
]


def front(
    path: StudyPath,
    data: Data = None,
    out: Out = None,
    workers: Workers = None,
    scheduler: Scheduler = None,
    retry: Retry = False,
    point: Point = None,
    as_json: Json = False,
    quiet: Quiet = False,
    verbose: Annotated[bool, flag("--verbose", "-v", says="Also every point of the front.")] = False,
) -> None:
    """Find the Pareto front on the response surfaces."""
    with guarded(as_json), keeping_runs(out, path):
        from doe.report.steps.front import asked_record, front_record, given_point_record
        from doe.study_file import Study
        from doe.workflow.front import find_front, with_survival
        from doe.workflow.goals import check_goals

        loaded = Study.load(path)
        check_goals(loaded)
        values = None if point is None else _point(loaded, point)
        effort = Effort(out, workers, scheduler, retry, quiet or as_json)
        surfaces = fitted(loaded, data, effort)
        found = with_survival(loaded, surfaces, find_front(loaded, surfaces))
        record = front_record(loaded, surfaces, found)
        if values is not None:
            import numpy as np

            record["point"] = given_point_record(loaded, surfaces, found, np.array(values))
        save(out, path, "front.json", record)
        summary = {"asked": asked_record(loaded), "front": record}
        hand_over(lambda: record, as_json, lambda: show(_answer(summary), Detail.of(quiet, verbose)))


def _answer(summary: dict[str, Any]) -> list[Block]:
    """The front's section of a report, of its factors and responses as ``asked`` and its record as ``front``."""
    from doe.report.sections.contents import readable
    from doe.report.sections.fronts import front_blocks
    from doe.report.sections.record import known

    clean = known(summary)
    return readable(front_blocks(clean), clean)


def _point(study: "Study", text: str) -> list[float]:
    """Factor values that ``--point`` names. Raises InputError with every fault."""
    from collections import Counter
    from math import nan

    from doe.study_file.table import RUN, is_number

    values = study.by_factor(study.baseline)
    parts = [part.strip() for part in text.split(",")]
    named = any("=" in part for part in parts)
    if not named and len(parts) != len(study.factors):
        raise InputError([f"--point {text}: give one value a factor ({', '.join(study.factors)}), or name=value"])
    pairs = [part.partition("=")[::2] for part in parts] if named else list(zip(study.factors, parts, strict=True))
    stripped = [(name.strip(), number.strip()) for name, number in pairs]
    counts = Counter(name for name, _ in stripped)
    faults = [f"--point {name}: given {count} times; give it once" for name, count in counts.items() if count > 1]
    for name, number in stripped:
        if name not in values:
            faults.append(f"--point {name}: no such factor; name one of {', '.join(values)}")
            continue
        value = float(number) if is_number(number) else nan
        if RUN.contains(value):
            values[name] = value
        else:
            faults.append(f"--point {name} = {number}: {RUN.fault(value)}")
    refuse(faults)
    return list(values.values())
