"""The figures of Hu et al. on the contact angles of a double-decker bearing: our numbers beside their statements."""

import importlib
from pathlib import Path

import pytest

EXAMPLES = Path(__file__).parents[2] / "examples"


@pytest.fixture
def example(monkeypatch):
    """The script, imported as it is run."""
    monkeypatch.syspath_prepend(str(EXAMPLES))
    return importlib.import_module("paper_001_double_decker")


def test_literature_growth_and_contact_angles(example):
    """Literature: angles fall with growth, more with speed, less in the outer layer; ceramic a quarter of steel, not more."""
    frame = example.angles((20000, 40000))
    part = frame.set_index(["rings", "growth", "speed_rpm"])
    steel, ceramic = (part.loc[(rings, "thick_ring", 40000)] for rings in ("steel", "ceramic"))
    assert steel["inner_layer_outer_percent"] == pytest.approx(-1.00, abs=0.01)
    assert steel["inner_layer_inner_percent"] == pytest.approx(-1.39, abs=0.01)
    assert steel["outer_layer_outer_percent"] == pytest.approx(-0.022, abs=0.001)
    assert ceramic["inner_layer_outer_percent"] / steel["inner_layer_outer_percent"] == pytest.approx(0.28, abs=0.01)
    printed = part.loc[("steel", "paper", 40000)]
    assert printed["inner_growth_um"] == pytest.approx(0.2632, abs=1e-4)
    assert example.LARGEST / printed["inner_layer_outer_percent"] == pytest.approx(2.35, abs=0.05)
    told = {statement.split(" (")[0]: ours.split(":")[0] for statement, ours, _ in example.statements(frame)}
    assert list(told.values()) == ["agrees", "agrees", "agrees", "differs", "differs", "differs"]


def test_unit_pictures_and_tables(example, tmp_path):
    """Unit: the check draws both pictures and prints three tables without holes."""
    check = example.paper_001((30000, 40000))
    check.draw(tmp_path / "paper_001.png")
    assert sorted(path.name for path in tmp_path.iterdir()) == ["paper_001.png", "paper_001_materials.png"]
    for table in check.tables:
        assert all(len(row) == len(table.header) for row in table.rows)
    assert check.conclusion.startswith("3 of 6 statements agree")
