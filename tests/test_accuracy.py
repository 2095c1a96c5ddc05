"""Error against run time: the table, its reference row and its conclusion."""

from __future__ import annotations

import pytest

from rbdyn import accuracy


@pytest.fixture(scope="module")
def rows(outer):
    """Three tolerances on the shared scene."""
    return accuracy.work_precision(outer, (1e-4, 5e-2, 1e-2))


def test_tighter_tolerance_takes_more_steps_and_closes_better(rows):
    assert [row.rtol for row in rows] == [5e-2, 1e-2, 1e-4]
    assert rows[0].steps_per_turn < rows[1].steps_per_turn < rows[2].steps_per_turn
    assert rows[0].power_gap > rows[1].power_gap > rows[2].power_gap


def test_reference_row_has_no_bias(rows):
    assert set(rows[-1].bias) == {"impact_force_N", "whirl_deviation_ratio", "power_loss_W"}
    assert set(rows[-1].bias.values()) == {0.0}
    for row in rows[:-1]:
        for name, bias in row.bias.items():
            assert row.value[name] == pytest.approx(rows[-1].value[name] * (1.0 + bias))


def test_conclusion_names_a_tolerance_that_closes_in_power(rows, outer):
    chosen = float(accuracy.conclusion(rows, outer).split()[1])
    assert next(row for row in rows if row.rtol == chosen).power_gap <= 0.005


def test_files_are_written(rows, outer, tmp_path):
    files = accuracy.write(rows, outer, tmp_path)
    assert files == ["accuracy.json", "accuracy.csv", "accuracy.png"]
    assert all((tmp_path / name).stat().st_size > 100 for name in files)
