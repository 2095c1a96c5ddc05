"""What the published checks claim of others: kinds, verdicts beyond errors, and what each source says."""

from __future__ import annotations

from pathlib import Path
from typing import get_args

import pandas as pd
import pytest

EXAMPLES = Path(__file__).parents[2] / "examples"


@pytest.fixture(autouse=True)
def examples_on_path(monkeypatch):
    """Scripts find what lies beside them, as when they are run."""
    monkeypatch.syspath_prepend(str(EXAMPLES))


def slips(rows):
    """A frame of slips with their errors and cage speeds, by name or by speed and load."""
    columns = ["slip", "slip_error", "cage_speed_rpm"]
    index = pd.MultiIndex.from_tuples(rows) if isinstance(next(iter(rows)), tuple) else list(rows)
    return pd.DataFrame(rows.values(), columns=columns, index=index)


@pytest.fixture
def base():
    """Slips as they were found, by speed and load; the kinematic cage speed at 5000 rpm is 2137.8 rpm."""
    return slips({
        (2400, 1000): (0.113, 0.005, 910.2), (2400, 5000): (0.023, 0.001, 1002.0),
        (5000, 500): (0.541, 0.003, 981.2), (5000, 1000): (0.23, 0.001, 1646.1), (5000, 5000): (0.035, 0.001, 2063.0),
    })  # fmt: skip


LOADS = (500, 1000, 5000)


def skidding_findings(base, changed):
    """By their words."""
    from published.skidding import findings

    return {one.words: one for one in findings(base, changed, LOADS)}


def test_unit_verdicts_need_differences_beyond_error():
    """Unit: agrees and differs only beyond error; an unknown error decides nothing."""
    from published.common import verdict_of

    assert verdict_of(0.2, 0.1) == "agrees" and verdict_of(-0.2, 0.1) == "differs"
    for beyond, error in ((0.05, 0.1), (-0.05, 0.1), (0.2, float("nan")), (0.0, 0.0)):
        assert verdict_of(beyond, error) == "unclear"


def test_unit_findings_are_counted_by_kind():
    """Unit: every finding is counted once, under its kind and its verdict."""
    from published.common import Finding, Kind, Verdict, findings_table, tally, tally_table

    assert set(get_args(Kind)) == {"measured", "trend", "model against model", "cross-check"}
    found = [
        Finding("a", "s", "measured", "1", "agrees"), Finding("b", "s", "measured", "1", "untested"),
        Finding("c", "s", "trend", "1", "unclear"), Finding("d", "s", "trend", "1", "differs"),
    ]  # fmt: skip
    table = tally_table(found)
    assert table.header == ("kind", "findings", *get_args(Verdict))
    assert table.rows == (("measured", "2", "1", "0", "0", "1"), ("trend", "2", "0", "1", "1", "0"))
    assert tally(found) == "measured 1 of 2 agree (1 untested), trend 0 of 2 agree (1 unclear)"
    assert [row[2] for row in findings_table(found).rows] == [one.kind for one in found]


def test_literature_sliding_speed_of_the_other_model(base):
    """Literature: 23 % slip is 5.3 m/s at the inner race where Yan et al.'s model has 7: a model, and it differs."""
    from published.skidding import sliding_speed

    epicyclic = 2500.0 * (1.0 - 15.0 / 103.535)
    assert sliding_speed(0.23, epicyclic) == pytest.approx(5.33, abs=0.01)
    # Closed form: the inner race's speed less twice that of the rollers' centres.
    inner, centres = 523.6 * 0.0885 / 2.0, 0.77 * epicyclic * 0.104720 * 0.103535 / 2.0
    assert sliding_speed(0.23, epicyclic) == pytest.approx(inner - 2.0 * centres, rel=2e-3)
    found = skidding_findings(base, base.iloc[:0])["sliding at 7 m/s at 5000 rpm and 1000 N"]
    assert (found.kind, found.verdict) == ("model against model", "differs") and "second-hand" in found.source
    base.loc[(5000, 1000)] = (0.30, 0.001, 1496.4)
    assert skidding_findings(base, base.iloc[:0])[found.words].verdict == "agrees"


def test_literature_five_per_cent_is_prediction_against_measurement(base):
    """Literature: the 5 % are those of a prediction against a measurement that is not told: nothing of ours is tested."""
    found = [one for one in skidding_findings(base, base.iloc[:0]).values() if "5 %" in one.words]
    assert [(one.kind, one.verdict) for one in found] == [("measured", "untested")]
    assert "epicyclic" not in found[0].words and "1002 rpm" in found[0].ours


def test_literature_order_of_cages_by_clearance(base):
    """Literature: polyamide slips more than brass at extensive clearance (Part I) and less at medium (Part III)."""
    brass, light = "clearance 0.02 mm", "clearance 0.02 mm, cage of 35 g polyamide"
    medium = "at medium clearance a polyamide cage slips less than brass"
    extensive = "at extensive clearance a polyamide cage slips more than brass (it deforms)"
    rigid = {
        "cage of 35 g polyamide": (0.22, 0.001, 1.0), brass: (0.285, 0.001, 1.0), light: (0.280, 0.001, 1.0),
    }  # fmt: skip
    found = skidding_findings(base, slips(rigid))
    assert (found[medium].verdict, found[extensive].verdict) == ("agrees", "differs")
    assert "Part III" in found[medium].source and found[extensive].source == "Dawoud et al., Part I (abstract)"
    assert {found[medium].kind, found[extensive].kind} == {"measured"}
    swapped = rigid | {brass: rigid[light], light: rigid[brass]}
    assert skidding_findings(base, slips(swapped))[medium].verdict == "differs"
    noisy = rigid | {brass: (0.285, 0.02, 1.0)}
    assert skidding_findings(base, slips(noisy))[medium].verdict == "unclear"
    assert medium not in skidding_findings(base, slips({brass: rigid[brass]}))


def test_literature_trends_of_slip(base):
    """Literature: slip falls with load and rises with speed and oil, as a trend each; noise leaves them unclear."""
    oily = slips({"oil fraction 5 %": (0.295, 0.001, 1.0)})
    words = ("sliding falls as load rises", "sliding rises with speed", "more oil, more sliding")
    found = skidding_findings(base, oily)
    assert [(found[one].kind, found[one].verdict) for one in words] == [("trend", "agrees")] * 3
    noisy = base.assign(slip_error=0.6)
    assert [skidding_findings(noisy, oily)[one].verdict for one in words] == ["unclear"] * 3
    base.loc[(5000, 5000), "slip"] = 0.4
    assert skidding_findings(base, oily)[words[0]].verdict == "differs"


def test_unit_other_checks_name_their_kinds():
    """Unit: words of the paper are trends, its figures another model, the makers' formulas cross-checks."""
    from published.operating import friction_findings, optimum_findings, trend_findings
    from published.whirl import findings as whirl_findings

    rows = [
        ("power loss with speed", "law", "design", "1", "2", "+100 %", "rises", "rises"),
        ("impact force with load", "law", "design", "1", "1", "0 %", "level", "falls"),
        ("whirl ratio with load", "law", "design", "1", "2", "+1 %", "rises", "falls, then rises"),
    ]
    found = trend_findings(rows)
    assert [one.verdict for one in found] == ["agrees", "unclear", "differs"]
    assert {one.kind for one in found} == {"trend"}

    names = ("impact_force_N", "whirl_deviation_ratio", "power_loss_W")
    points = [
        {"law": "law", "design": design, **dict.fromkeys(names, value), **{f"{name}_error": 1.0 for name in names}}
        for design, value in (("design", 100.0), ("optimum", 97.0), ("design", 100.0), ("optimum", 97.0))
    ]
    optimum = optimum_findings(pd.DataFrame(points))
    # -3 ± 1 % beside -9.26, -2.87 and -1.45 %.
    assert [one.verdict for one in optimum] == ["differs", "agrees", "differs"]
    assert {one.kind for one in optimum} == {"model against model"}

    watts = {"races_W": 137.0, "total_W": 239.0, "skf_rolling_W": 150.0, "skf_sliding_W": 4.0}
    palmgren = {"palmgren_2_W": 117.0, "palmgren_6_W": 265.0}
    formulas = friction_findings(pd.Series(watts | palmgren))
    assert [(one.kind, one.verdict) for one in formulas] == [("cross-check", "agrees")] * 2
    assert friction_findings(pd.Series(watts | palmgren | {"total_W": 300.0}))[1].verdict == "differs"

    frame = pd.DataFrame({"law": ["a", "a"], "fill": [1.0, 0.1], "ratio": [0.5, 0.8], "ratio_error": [0.05, 0.05]})
    (whirl,) = whirl_findings(frame)
    assert (whirl.kind, whirl.verdict) == (
        "model against model",
        "differs",
    ) and "0.500 ± 0.050 (a, fill 1)" in whirl.ours


def test_unit_table_4_levels_and_signs():
    """Unit: a level is another model's figure and agrees within its error; a sign is a trend."""
    from published.chen_2022 import FACTORS, findings

    row = {"law": "law", "response": "power_loss_W", "level_ratio": 0.57, "level_ratio_error": 0.02}
    for name, sign in zip(FACTORS, ("same", "opposite", "unclear"), strict=True):
        row |= {f"theirs_{name}": -1.0, f"sign_{name}": sign}
    found = findings(pd.DataFrame([row]))
    assert [one.kind for one in found] == ["model against model", *["trend"] * 3]
    assert [one.verdict for one in found] == ["differs", "agrees", "differs", "unclear"]
    assert found[1].words == "power loss falls with A radial clearance"
    assert findings(pd.DataFrame([row | {"level_ratio": 0.99}]))[0].verdict == "agrees"
