"""Numbers that must not change by accident, against those kept: bit for bit on their platform, else to 1e-9."""

import json

import numpy as np
import pytest
from regenerate import CASES, FILE, HERE, computed, this_platform
from stock_numba import by_stock

KEPT = json.loads(FILE.read_text(encoding="utf-8"))


def test_golden_every_case_is_kept():
    """Golden: the file has the cases of the script, and names the platform it was made on."""
    assert list(KEPT["cases"]) == list(CASES)
    assert KEPT["platform"].keys() == this_platform().keys()


@pytest.mark.parametrize("case", CASES)
def test_golden_numbers(case):
    """Golden: a change on purpose is kept by ``python tests/golden/regenerate.py``.

    Elsewhere the largest coordinate, speed and spin of the rollers set the scale of a motion's, and the others have their
    round-off besides.
    """
    found, kept = np.array(computed(case)), np.array(KEPT["cases"][case])
    assert found.shape == kept.shape
    if this_platform() == KEPT["platform"]:
        assert found.tobytes() == kept.tobytes(), f"largest difference {np.abs(found - kept).max():.3g}"
    elif case.startswith("motion"):
        for part in (slice(0, 20), slice(20, 40), slice(40, 50)):
            assert found[part] == pytest.approx(kept[part], abs=1e-9 * np.abs(kept[part]).max(), rel=0.0)
        assert found[50:] == pytest.approx(kept[50:], rel=1e-9, abs=1e-12)
    else:
        assert found == pytest.approx(kept, rel=1e-9, abs=1e-12)


@pytest.mark.slow
@pytest.mark.parametrize("case", ["motion everything", "equilibrium angular_contact_ball"])
def test_golden_stock_numba(case):
    """Golden: compiled by stock numba, of which a name is gone that parts need, a scene has the bits of the usual way."""
    stock = by_stock(str(HERE.parent / "helpers" / "stock_numba.py"), case)
    assert "JITCodeLibrary" in stock["notes"][0]
    assert stock["cases"][case] == computed(case)
