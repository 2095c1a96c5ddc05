"""What the commands hand out on small runs, against what is kept: to the letter on its platform, elsewhere keys, headers and words."""

import pytest
from outputs import FOLDER, OUTPUTS, form_of, handed_out, kept
from regenerate import PLATFORMS, platforms, this_platform

CASES = [pytest.param(case, marks=[pytest.mark.slow] * output.slow) for case, output in OUTPUTS.items()]


def test_golden_every_output_is_kept():
    """Golden: there is a folder for each case and no other, and its platform is known."""
    assert {path.name for path in FOLDER.iterdir()} == {*OUTPUTS, PLATFORMS.name}
    assert platforms().keys() == OUTPUTS.keys()


@pytest.mark.parametrize("case", CASES)
def test_golden_outputs(case):
    """Golden: a change on purpose is kept by ``python tests/golden/regenerate.py CASE``, and its difference read."""
    found, before = handed_out(case), kept(case)
    assert found.keys() == before.keys()
    alike = this_platform() == platforms()[case]
    for name, text in found.items():
        if alike:
            assert text.splitlines() == before[name].splitlines(), f"{case}/{name}"
        else:
            assert form_of(case, name, text) == form_of(case, name, before[name]), f"{case}/{name}"
