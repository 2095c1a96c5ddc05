"""Pictures of the front stay readable: which pairs of responses they have, which limits, and how large they get."""

import pytest

from doe.report.sections.front_pictures import MOST_PAIRS, Front, Fronts, drawn_pairs, near
from doe.report.still import save
from doe.workflow.front_record import Point


def test_unit_pairs_are_of_goals():
    """Unit: two goals of five responses are one pair, one goal is drawn against what is limited, ten goals make no more than fifteen."""
    assert drawn_pairs(["none", "min", "none", "target", "none"]) == [(1, 3)]
    assert drawn_pairs(["none", "max", "none"]) == [(1, 0), (1, 2), (0, 2)]
    assert len(drawn_pairs(["min"] * 6 + ["none"] * 9)) == len(drawn_pairs(["min"] * 10)) == MOST_PAIRS == 15


def test_unit_a_limit_far_away_is_left_out():
    """Unit: of a front from 10 to 20 limits from 0 to 30 are drawn."""
    assert near([-1.0, 0.0, 15.0, 30.0, 31.0], [10.0, 20.0, float("nan")]) == [0.0, 15.0, 30.0]


@pytest.mark.parametrize(("goals", "limited", "size"), [(2, 0, (1, 2)), (3, 9, (2, 2)), (6, 9, (6, 3))])
def test_unit_a_picture_of_the_front_has_a_few_panels_in_a_row(tmp_path, goals, limited, size):
    """Unit: its width has a bound, and the last panel is the legend of all."""
    from matplotlib import image

    names = [f"response_{place}_N" for place in range(goals + limited)]
    front = Front("front", "drawn", [Point({}, dict.fromkeys(names, float(x))) for x in range(3)])
    kinds, path = ["min"] * goals + ["none"] * limited, tmp_path / "front.png"
    stills = Fronts([front], {"baseline": front.points[0]}).pairs(dict(zip(names, kinds, strict=True)))
    assert len(stills) == len(drawn_pairs(kinds)) + 1
    save(stills, path)
    rows, columns = size
    # A row of the legend alone is lower.
    full = rows - (len(stills) % columns == 1)
    high, wide, _ = image.imread(path).shape
    assert 600 * columns < wide < 670 * columns and 480 * full < high < 520 * rows
