"""A whole study as one HTML page that can be mailed.

The page fetches nothing, and all but the interactive pictures can be read without scripts and on paper. ``sections`` lists its
chapters in the order in which they are read; what a record lacks is left out. The scripts and the controls are
files of ``html``; ``page_data`` holds the numbers for the scripts, and nothing else.
"""

import json
import math
import string
from collections.abc import Mapping, Sequence
from dataclasses import replace
from importlib.resources import files
from pathlib import PurePath
from types import MappingProxyType
from typing import Any

from doe.clearance import DrawnMotion
from doe.report.sections import answer, chain, design, duty, fit, front, unknown
from doe.report.sections.answer import tolerance_of
from doe.report.sections.design import failure_table
from doe.report.sections.front import fronts, picks
from doe.report.summary import Summary, readable
from doe.workflow.front_record import EstimatedPoint, Point, RobustPoint
from doe.workflow.problem import Asked, Factor, Response
from rbdyn.base import html
from rbdyn.base.blocks import Block, Bullets, Paragraph, Remarks, Section, Table, Verdict, Widget, has_content
from rbdyn.base.html import identity_section, page
from rbdyn.base.words import label, quantity, rounded_down, shown

# Motions by the name of their point.
Motions = Mapping[str, DrawnMotion]
# In the order in which they need each other; the moving bearing is drawn by the script of ``rbdyn show``.
SCRIPTS = {
    "page": ("page.js", "tables.js"),
    "surface": ("model.js", "emulator.js", "viridis.js", "contours.js", "surface.js", "surface_view.js"),
    "front": ("front.js",),
    "bearing": ("motion.js",),
}
NO_SCRIPTS = (
    '<noscript><p class="note">Scripts are off: all tables and static pictures are here; only the interactive ones are not.'
    "</p></noscript>"
)
# Letters of packed numbers, each worth its place, in the order of base 64; ``motion.js`` has the same.
LETTERS = string.ascii_uppercase + string.ascii_lowercase + string.digits + "+/"
# Of two letters: distinct numbers less one that keeps zero exact and one for rounding.
STEPS = len(LETTERS) ** 2 - 2


def html_report(summary: Summary, motion: Motions = MappingProxyType({})) -> str:
    """A study as one HTML page; without ``motion`` nothing moves."""
    chapters = sections(summary, motion)
    widgets = {block.name for section in chapters for block in section.blocks if isinstance(block, Widget)}
    data = f'<script type="application/json" id="data">{_json(page_data(summary, motion))}</script>'
    scripts = [data, *(f"<script>\n{script}</script>" for script in _scripts(widgets))]
    warnings = sum(
        isinstance(block, Paragraph) and block.role == "warning" for block in chapters[0].blocks if has_content(block)
    )
    verdict = Verdict(tuple(summary.notes), warnings=warnings)
    opening = "".join(map(html.render, readable([verdict], summary.asked)))
    window = f"{title(summary)}: {summary.identity.title}"
    document = NO_SCRIPTS + opening
    return page(window, title(summary), chapters, lambda name: text(f"{name}.html"), document, "\n".join(scripts))


def title(summary: Summary) -> str:
    """The name of the file of the study in words."""
    stem = PurePath(summary.asked.study_file).stem.replace("_", " ")
    return stem[:1].upper() + stem[1:]


def sections(summary: Summary, motion: Motions = MappingProxyType({})) -> list[Section]:
    """Sections with something to say."""
    chapters = [
        Section("answer", "The answer", answer.first_screen(summary)),
        identity_section(summary.identity),
        duty.duty(summary),
        answer.settings(summary),
        design.design(summary),
        fit.surfaces(summary),
        fit.diagnostics(summary),
        front.front(summary),
        answer.confirmation(summary),
        unknown.robustness(summary),
        chain.chains(summary),
        answer.power(summary),
        answer.motion(motion),
        reference(summary),
        settings(summary),
        notes(summary),
    ]
    filled = [replace(section, blocks=readable(section.blocks, summary.asked)) for section in chapters if section]
    return [section for section in filled if section.blocks]


def text(name: str) -> str:
    """A file of the page."""
    return files("doe.report").joinpath("html", name).read_text(encoding="utf-8")


def _scripts(widgets: set[str]) -> list[str]:
    """Scripts of the page and of the widgets on it."""
    scripts = []
    for widget, names in SCRIPTS.items():
        if widget in widgets | {"page"}:
            if widget == "bearing":
                scripts.append(files("rbdyn").joinpath("plots", "bearing.js").read_text(encoding="utf-8"))
            scripts += [text(name) for name in names]
    return scripts


def _json(record: Mapping[str, Any]) -> str:
    """Data inside a script element: no name in it can end the element."""
    return json.dumps(record, separators=(",", ":"), allow_nan=False).replace("<", "\\u003c")


def page_data(summary: Summary, motion: Motions) -> dict[str, Any]:
    """Factors, surfaces, runs, fronts and motion, ready for JSON."""
    inputs = summary.asked.factors
    names = summary.asked.names
    marks = picks(summary)
    record = {
        "factors": [_factor(summary, factor) for factor in inputs],
        "responses": [{"name": response.name, **_named(response)} for response in summary.asked.responses],
        "surfaces": _surfaces(summary),
        "runs": [
            {
                "run": run.run,
                "factors": list(run.factors.values()),
                "values": {name: run.responses[name].value if run.responses else None for name in names},
            }
            for run in summary.design.points
        ],
        "marks": {name: [marks[name].factors[factor.name] for factor in inputs] for name in ("baseline", "pick")},
        "fronts": [
            {"words": points.words, "points": [_point(point, summary.asked) for point in points.points]}
            for points in fronts(summary)
        ],
        "compared": {name: _point(point, summary.asked) for name, point in marks.items()},
        "motion": {name: _moving(run.moving) for name, run in motion.items()},
    }
    if summary.adaptive is not None:
        region = [summary.adaptive.region[name] for name in summary.asked.columns]
        record["emulators"] = summary.adaptive.emulators.as_dict() | {"region": region}
    return record


def _factor(summary: Summary, factor: Factor) -> dict[str, Any]:
    keys = ("name", "words", "unit", "letter", "centre", "step", "low", "high", "decimals")
    tolerance = tolerance_of(summary, factor)
    return {key: getattr(factor, key) for key in keys} | {"tolerance": rounded_down(tolerance) if tolerance else None}


def _named(response: Response) -> dict[str, str]:
    words, unit = quantity(response.name)
    return {"words": response.label, "unit": ""} if response.is_ratio else {"words": words, "unit": unit}


def _point(point: Point, asked: Asked) -> dict[str, Any]:
    """Short keys, for there are many: x factors, y responses, e half-widths, r values with tolerances."""
    values = {
        "x": [_rounded(point.factors[name]) for name in asked.columns],
        "y": [_rounded(point.responses[name]) for name in asked.names],
    }
    if isinstance(point, EstimatedPoint):
        values["e"] = [_rounded(point.errors[name], 2) for name in asked.names]
    if isinstance(point, RobustPoint):
        values["r"] = [_rounded(point.robust.get(name)) for name in asked.names]
    return values


def _rounded(value: float | None, digits: int = 6) -> float | None:
    return None if value is None else float(f"{value:.{digits}g}")


def _moving(motion: Mapping[str, Any]) -> dict[str, Any]:
    """The motion of a point, its series of every roller packed."""
    return {
        key: packed(value) if isinstance(value, list) and len(value) > motion["frames"] else value
        for key, value in motion.items()
        if value is not None
    }


def packed(numbers: Sequence[float]) -> dict[str, Any]:
    """Numbers as ``step`` (``first`` + k), each k of ``letters`` in two: to a four-thousandth of their range, zero exactly."""
    low, high = min(numbers), max(numbers)
    step = float(f"{(high - low) / STEPS:.6g}") or 1.0
    first = math.floor(low / step)
    counts = [round(number / step) - first for number in numbers]
    return {"step": step, "first": first, "letters": "".join(LETTERS[k // 64] + LETTERS[k % 64] for k in counts)}


def _surfaces(summary: Summary) -> list[dict[str, Any]]:
    """Terms and coefficients with their covariance, and what a 95 % confidence interval needs besides."""
    from scipy.stats import t

    return [
        {
            "name": name,
            "bounds": summary.asked.response(name).bounds,
            **_named(summary.asked.response(name)),
            "terms": list(fitted.by_term),
            "coefficients": list(fitted.by_term.values()),
            "covariance": fitted.covariance.tolist(),
            "student": float(t.ppf(0.975, fitted.interval_dof)),
            "missed": None if fitted.model_error is None else fitted.model_error.variance,
            "power": fitted.transform,
        }
        for name, fitted in summary.fit.responses.items()
    ]


def reference(summary: Summary) -> Section:
    """Levels, effects and ranks compared with a published table, with the reasons for what differs."""
    levels, effects, words = [], [], []
    for name, row in summary.published_comparisons.items():
        levels.append((f"{label(name)}, ours", *map(shown, row.ours_min_mean_max), shown(row.rank_correlation, 2)))
        levels.append((f"{label(name)}, theirs", *map(shown, row.theirs_min_mean_max), ""))
        for factor, effect in row.linear_effects.items():
            sizes = (f"{effect.ours:+.3g}", f"{effect.theirs:+.3g}")
            effects.append((label(name), label(factor), *sizes, "same" if effect.same_sign else "opposite"))
        words.append(" ".join(filter(None, (row.verdict, row.why))))
    levels_header = ("response", "least", "mean", "largest", "rank correlation")
    header = ("response", "factor", "ours", "theirs", "sign")
    blocks: list[Block] = [
        Bullets(words),
        Table("Levels", levels_header, levels),
        Table("Linear effects per coded unit", header, effects, text_columns=(1, 4)),
    ]
    return Section("reference", "Compared with the published table", blocks)


def settings(summary: Summary) -> Section:
    """Seeds, versions and cost: what it takes to get the same numbers again."""
    tables: dict[str, Mapping[str, Any]] = {
        "Seeds": summary.seeds,
        "Versions": summary.versions,
        "Cost, times in seconds": summary.cost,
    }
    blocks = [
        Table(caption, ("", "value"), [(label(name), shown(value)) for name, value in figures.items()])
        for caption, figures in tables.items()
    ]
    return Section("settings", "Settings, versions, cost", blocks)


def notes(summary: Summary) -> Section:
    """Runs that failed, and limits of the model that the runs met."""
    return Section(
        "notes", "Notes and failures", [failure_table(summary.failures), Remarks(tuple(summary.notes), gathers=True)]
    )
