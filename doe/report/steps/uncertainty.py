"""What the unknown inputs of a scene do: as blocks, as JSON, as tables and as a picture."""

import csv
from pathlib import Path
from typing import Any

from doe.report.words import of_hundred
from doe.study_file.table import text_of
from doe.unknown.propagation import CONFIDENCE, Share
from doe.workflow.uncertainty import OutputRange, Uncertainty
from rbdyn.base.blocks import Block, Bullets, Detail, Note, Paragraph, Table
from rbdyn.base.words import counted, quantity, shown, with_error
from rbdyn.result import write_json

FORMAT = "doe.uncertainty/1"
# Inputs that a sentence names, and the smallest share that it is worth.
NAMED, WORTH = 2, 0.1


def record_of(found: Uncertainty) -> dict[str, Any]:
    """JSON record of ``doe uncertainty``."""
    sets = found.sets
    return {
        "format": FORMAT,
        "scene": str(found.path),
        "responses": {name: _output(each) for name, each in found.outputs.items()},
        "inputs": [
            {"key": each.key, "law": each.law.model_dump(exclude_none=True), "reason": each.reason}
            for each in found.inputs
        ],
        "screened": dict(found.screened),
        "runs": len(sets.outputs),
        "failed": len(sets.failures) + len(sets.impossible),
        "seed": found.seed,
        "notes": list(found.notes),
    }


def _output(output: OutputRange) -> dict[str, Any]:
    spread, indices, shapley, keys = output.spread, output.indices, output.shapley, output.keys
    return {
        **output.nominal.as_dict(),
        "input": {"low": spread.low, "median": spread.median, "high": spread.high, "errors": list(spread.errors)},
        "variance": spread.variance,
        "first": None if indices is None else dict(zip(keys, map(list, indices.first), strict=True)),
        "total": None if indices is None else dict(zip(keys, map(list, indices.total), strict=True)),
        "shapley": None if shapley is None else dict(zip(keys, map(list, shapley), strict=True)),
        "floor": None if output.floor is None else list(output.floor),
        "q2": spread.q2,
        "ceiling": spread.ceiling,
        "trusted": spread.by_emulator,
    }


def sentence(name: str, output: OutputRange) -> str:
    """'impact force 87.1 ± 0.4 N; 60 to 132 N in 90 % of the cases over the unknown inputs; the bar stiffness makes 87 %'."""
    words, unit = quantity(name)
    nominal, spread = output.nominal, output.spread
    head = f"{words} {with_error(nominal.value, nominal.stated_error)} {unit}".rstrip()
    ends = f"{shown(spread.low)} to {shown(spread.high)} {unit}".rstrip()
    if spread.hidden:
        return f"{head}; simulation noise exceeds the effect of the inputs"
    outside = "" if spread.low <= nominal.value <= spread.high else ", without the scene's own value"
    return f"{head}; {ends} in 90 % of the cases over the unknown inputs{outside}; {_decides(output)}"


def _decides(output: OutputRange) -> str:
    if output.shares is None or output.floor is None:
        return "which input makes it is unknown"
    floor = output.floor.high
    ranked = sorted(zip(output.shares, output.keys, strict=True), reverse=True)
    above = [(index, key) for index, key in ranked if index.value > max(floor, WORTH)][:NAMED]
    return " and ".join(f"{key} makes {100.0 * index.value:.0f} %" for index, key in above) or "no input stands out"


def blocks(found: Uncertainty) -> list[Block]:
    """A sentence an output, a table of shares, where a run's variance comes from, which inputs are in no emulator, notes."""
    shares = [_by_key(output) for output in found.outputs.values()]
    rows = [(key, *(_share(each.get(key)) for each in shares)) for key in _keys(found)]
    floor = ("an input that does nothing", *(_share(output.floor) for output in found.outputs.values()))
    header = ("input", *(quantity(name)[0] for name in found.outputs))
    caption = f"{_what(found)} [%], {100.0 * CONFIDENCE:.0f} % intervals"
    parts = [
        (quantity(name)[0], *(f"{100.0 * share:.1f}" for share in output.spread.variance.values()))
        for name, output in found.outputs.items()
    ]
    sources = ("output", "simulation", "integration", "inputs")
    screened = ""
    if found.screened:
        most = max(found.screened, key=lambda key: found.screened[key])
        screened = (
            f"Varied in every set, but in no emulator: {counted(len(found.screened), 'further input')}; "
            f"alone none makes more than {100.0 * found.screened[most]:.2g} % of an output's variance ({most})."
        )
    return [
        Bullets([sentence(name, output) for name, output in found.outputs.items()]),
        Table(caption, header, [*rows, floor]),
        Table("What a single run's variance comes from [%]", sources, parts),
        Paragraph(screened),
        *(Note(note, Detail.LEAST) for note in found.notes),
    ]


def _by_key(output: OutputRange) -> dict[str, Share]:
    """What each input of an output's emulator makes; nothing where that is unknown."""
    return dict(zip(output.keys, output.shares or (), strict=output.shares is not None))


def _keys(found: Uncertainty) -> list[str]:
    """Inputs of any emulator."""
    return [each.key for each in found.inputs if each.key not in found.screened]


def _what(found: Uncertainty) -> str:
    """What the shares are of."""
    if any(output.shapley for output in found.outputs.values()):
        return "Share of the variance over all inputs, divided among inputs that go together (Shapley)"
    return "Share of the variance over all inputs that is left while an input is unknown"


def _share(share: Share | None) -> str:
    return "" if share is None else of_hundred(share)


def write(found: Uncertainty, folder: Path) -> list[str]:
    """uncertainty.json, input_sets.csv and uncertainty.png; returns their names."""
    write_json(folder / "uncertainty.json", record_of(found))
    keys = [each.key for each in found.inputs]
    with (folder / "input_sets.csv").open("w", newline="", encoding="utf-8") as file:
        table = csv.writer(file)
        table.writerow(map(text_of, [*keys, *found.outputs]))
        for values, outputs in zip(found.sets.inputs, found.sets.outputs.tolist(), strict=True):
            table.writerow(map(text_of, [*(values[key] for key in keys), *outputs]))
    draw(found, folder / "uncertainty.png")
    return ["uncertainty.json", "input_sets.csv", "uncertainty.png"]


def draw(found: Uncertainty, path: Path) -> None:
    """A column an output: above the runs of the input sets with the scene's own value, below what each input makes of them."""
    from rbdyn.plots.style import BLUE, GREY, ORANGE, plain, plt, save

    whole, count = _keys(found), len(found.outputs)
    keys = [key.partition(".")[2] for key in whole]
    figure, axes = plt.subplots(2, count, figsize=(3.4 * count + 2.0, 3.0 + 0.28 * len(keys)), squeeze=False,
                                height_ratios=(1.0, 0.14 * len(keys) + 0.3))  # fmt: skip
    for column, (name, output) in enumerate(found.outputs.items()):
        above, below = axes[:, column]
        words, unit = quantity(name)
        above.hist(found.sets.outputs[:, column], bins=24, color=BLUE, alpha=0.45)
        above.axvspan(output.spread.low, output.spread.high, color=BLUE, alpha=0.12, label="5 to 95 % of the cases")
        above.axvline(output.nominal.value, color=ORANGE, label="as the scene says")
        above.set(xlabel=f"{words} [{unit}]" if unit else words, ylabel="input sets" if column == 0 else "")
        plain(above)
        plain(below)
        by_key = _by_key(output)
        if output.shares is None or output.floor is None:
            below.text(0.5, 0.5, "unknown", transform=below.transAxes, ha="center", color=GREY)
        else:
            places, shares = [whole.index(key) for key in by_key], list(by_key.values())
            below.barh(places, [100.0 * each.value for each in shares], color=BLUE, alpha=0.6)
            below.hlines(
                places, [100.0 * each.low for each in shares], [100.0 * each.high for each in shares], color=GREY
            )
            below.axvline(100.0 * output.floor.high, color=GREY, linestyle=":")
        below.set(yticks=range(len(keys)), yticklabels=keys if column == 0 else [], xlim=(0.0, 100.0),
                  ylim=(len(keys) - 0.5, -0.5), xlabel="share of the variance [%]")  # fmt: skip
    axes[0, 0].legend(fontsize=8)
    save(figure, path)
