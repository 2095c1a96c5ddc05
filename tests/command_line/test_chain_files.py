"""Files of chains: the three clearances of the example bearing, several chains in one file, chains of a study."""

import json
import tomllib
from pathlib import Path

import pytest
from chains import by_name
from doe_command import doe
from instant_runs import instantly, unillustrated
from short_studies import short_study

from doe.dimension_chain import chain_from, fit_limits, read_chains, solve
from doe.report.sections.chain import chain_blocks
from doe.study_file.sections import StudyChain
from doe.workflow.problem import Problem
from rbdyn.base import terminal
from rbdyn.base.blocks import Detail
from rbdyn.base.faults import InputError, read_toml
from rbdyn.mounting.rings import MountedRings, Ring, mounted_clearance
from rbdyn.properties.catalogue import radial_clearance
from rbdyn.properties.materials import Material

EXAMPLES = Path(__file__).parents[2] / "examples"
BEARING = EXAMPLES / "bearing_chains.toml"
STUDY = Problem.load(EXAMPLES / "clearance_study.toml")


@pytest.fixture(scope="module")
def solved():
    return {name: solve(chain, samples=100_000) for name, chain in read_chains(BEARING).items()}


def test_the_chains_of_the_bearing_meet_the_clearances_of_its_scene(solved):
    scene = read_toml(EXAMPLES / "cylindrical_roller.toml")
    wanted = {
        "radial": scene["bearing"]["radial_clearance_mm"],
        "guide": scene["cage"]["guide_clearance_mm"],
        "pocket": scene["cage"]["pocket_clearance_mm"],
    }
    limits = {each["name"]: each["closing_link"] for each in read_toml(BEARING)["chain"]}
    for name, clearance in wanted.items():
        assert (limits[name]["lower_mm"] + limits[name]["upper_mm"]) / 2 == pytest.approx(clearance), name
        assert solved[name].status.startswith("ok: deviations allocated")
    assert solved["pocket"].worst_case_mm == pytest.approx((0.295, 0.305))
    assert solved["radial"].yields["as_given"] >= 0.9973 - 3 * solved["radial"].standard_errors["as_given"]


def test_the_radial_chain_loses_what_the_rings_of_the_simulator_lose(solved):
    part = by_name(solved["radial"])
    steel = Material(206e9, 0.3, 7827.0)
    sizes = {name: each.nominal_mm + each.mean_mm for name, each in part.items()}
    initial = sizes["outer_raceway"] - sizes["inner_raceway"] - 2 * sizes["rollers"]
    rings = MountedRings(
        shaft=Ring(0.0, 0.0135, steel),
        inner_ring=Ring(0.0135, 0.01725, steel),
        outer_ring=Ring(0.02626, 0.03, steel),
        housing=Ring(0.03, 0.04, steel),
        inner_interference=1e-3 * (sizes["shaft_seat"] - sizes["ring_bore"]),
        outer_interference=1e-3 * (sizes["ring_outside"] - sizes["housing_bore"]),
    )
    mounted = mounted_clearance(1e-3 * initial, rings, 0.009, steel)
    low, high = solved["radial"].rss_mm
    assert (low + high) / 2 == pytest.approx(1e3 * mounted.operating, abs=1e-9)


def test_the_example_of_all_keys_is_solved():
    chain = read_chains(EXAMPLES / "guide_chain_options.toml")["guide_chain_options"]
    result = solve(chain, samples=100_000)
    assert result.yields["as_given"] >= 0.999
    assert all(by_name(result)[link.name].grade for link in chain.free)
    assert result.selective.good >= result.yields["as_given"] - 3 * result.standard_errors["as_given"]


def test_matching_rings_narrows_the_clearance(solved):
    found = solved["radial"].selective
    assert found.matched_deviation_mm < 0.75 * found.random_deviation_mm


def test_graded_parts_stand_at_their_letters(solved):
    part = by_name(solved["guide"])
    assert (part["guide_land"].lower_mm, part["cage_outside"].upper_mm) == (0.0, 0.0)
    assert {each.grade for each in part.values()} == {"IT7"}


def test_several_chains_print_one_json_object():
    shown = doe("chain", str(BEARING), "--json")
    assert shown.returncode == 0, shown.stderr
    record = json.loads(shown.stdout)
    assert list(record) == ["chains", "status"] and record["status"] == "ok"
    assert list(record["chains"]) == ["radial", "guide", "pocket"]
    assert {"closing_link", "yield", "contributions", "allocation", "status"} <= set(record["chains"]["guide"])


def test_text_shows_parts_limits_yield_ppm_contributions_and_classes(solved):
    text = "".join(terminal.text(chain_blocks(name, result), Detail.ALL) for name, result in solved.items())
    for words in (
        "48.130 +0.025/0", "in worst case", "by root sum square", "ppm below", "Contributions",
        "Matched in 4 classes", "A linear chain would be off", "Quantiles of the closing link",
    ):  # fmt: skip
        assert words in text, words


def test_one_refused_chain_among_several_refuses_the_file(tmp_path):
    printed = (EXAMPLES / "pocket_chain_as_printed.toml").read_text(encoding="utf-8")
    right = (EXAMPLES / "pocket_chain.toml").read_text(encoding="utf-8")

    def named(name, text):
        body = text.replace("[[link]]", "[[chain.link]]").replace("[closing_link]", "[chain.closing_link]")
        return f'[[chain]]\nname = "{name}"\n' + body.replace("[allocate]", "[chain.allocate]")

    path = tmp_path / "two.toml"
    path.write_text(named("right", right) + "\n" + named("printed", printed), encoding="utf-8")
    shown = doe("chain", str(path), "--json")
    assert shown.returncode == 1
    assert json.loads(shown.stdout)["status"] == "refused: printed"
    assert f"{path}: chain printed: refused: the given deviations" in shown.stderr
    path.write_text(named("right", right) + named("right", right.replace("-1.0", "0.0")), encoding="utf-8")
    with pytest.raises(InputError) as caught:
        read_chains(path)
    assert caught.value.faults == [
        f'{path}: chain.name = "right": used 2 times; name each once',
        f'{path}: chain "right": link "roller_diameter": coefficient = 0: must not be zero; set it, remove the link, '
        "or use it in a function",
    ]


def test_a_study_takes_its_own_width_or_the_tolerance_found():
    link = [{"name": "a", "coefficient": 1.0, "nominal_mm": 0.3}]
    own = StudyChain(name="pocket", factor="p", half_width_mm=0.005, link=link)
    assert STUDY.chain_table(own, 0.3, 0.02)["closing_link"] == {"lower_mm": 0.295, "upper_mm": 0.305}
    found = StudyChain(name="pocket", factor="p", link=link)
    assert STUDY.chain_table(found, 0.3, 0.02)["closing_link"] == pytest.approx({"lower_mm": 0.28, "upper_mm": 0.32})
    with pytest.raises(InputError, match="chain pocket: half_width_mm: missing"):
        STUDY.chain_table(found, 0.3)
    beside = StudyChain(name="guide", factor="g", half_width_mm=0.02, file="bearing_chains.toml")
    table = STUDY.chain_table(beside, 0.15)
    assert [each["name"] for each in table["link"]] == ["guide_land", "cage_outside"]
    assert table["closing_link"] == pytest.approx({"lower_mm": 0.13, "upper_mm": 0.17})


BOUGHT = EXAMPLES / "bought_nu210_chain.toml"


def test_command_line_a_bought_bearing_leaves_its_seats_free():
    """Command line: class and ring tolerances stay as they are written, the seats get sizes, and a class of ISO 286 within."""
    shown = doe("chain", str(BOUGHT), "--json")
    assert shown.returncode == 0, shown.stderr
    parts = json.loads(shown.stdout)["parts"]
    assert {name for name, part in parts.items() if part["origin"] == "stated"} == {
        "clearance_CN",
        "ring_bore",
        "ring_outside",
    }
    limits = (1e3 * parts["clearance_CN"]["lower_mm"], 1e3 * parts["clearance_CN"]["upper_mm"])
    assert limits == radial_clearance(50.0, "CN", "cylindrical_roller")
    assert parts["ring_bore"]["text"] == "50 Normal bore (0/-0.012)"
    # The nominal of a seat is that of its ring; its fit is in the deviations.
    seat, housing = parts["shaft_seat"], parts["housing_bore"]
    assert (seat["nominal_mm"], seat["moved_mm"]) == (50.0, 0.0) and seat["upper_mm"] > seat["lower_mm"] > 0.0
    low, high = fit_limits(50.0, seat["iso_class"])
    assert seat["lower_mm"] <= low < high <= seat["upper_mm"] and housing["iso_class"] == "H6"
    # Written back as classes, the same chain is met.
    text = BOUGHT.read_text(encoding="utf-8")
    for name, size, part in (("shaft_seat", "50.0", seat), ("housing_bore", "90.0", housing)):
        head = f'name = "{name}"\ncoefficient = 0.0\nnominal_mm = {size}'
        assert head in text
        text = text.replace(head, f'{head}\nfit = "{part["iso_class"]}"\n#')
    stated = solve(chain_from(tomllib.loads(text), "x"), samples=1000)
    assert [part.fit for part in stated.parts] == [None, "Normal bore", "Normal outside", seat["iso_class"], "H6"]
    assert stated.status == "ok"


@pytest.mark.parametrize("options", [(), ("--quiet",), ("--json",)])
def test_command_line_a_chain_that_misses_ends_with_one_and_shows_all(options, tmp_path):
    """Command line: exit code 1, the contributions, by how much, and what would meet it; JSON holds the whole object."""
    path = tmp_path / "tight.toml"
    path.write_text(BOUGHT.read_text(encoding="utf-8").replace("= 0.045", "= 0.030"), encoding="utf-8")
    shown = doe("chain", str(path), *options)
    assert shown.returncode == 1 and f"{path}: refused: allocate.target_yield = 0.9973" in shown.stderr
    if options == ("--json",):
        record = json.loads(shown.stdout)
        assert record["missed"]["yield_short"] > 0.01 and record["remedy"]["mode_yield"] is None
        assert record["contributions_mm"]["clearance_CN"]["worst_case_mm"] == pytest.approx(0.03)
        return
    for words in ("Contributions to the scatter", "clearance CN", "does not reach its yield: ", "Write selective = {"):
        assert words in shown.stdout, words


def test_command_line_a_wrong_chain_ends_with_two(tmp_path):
    """Command line: bad input is no miss; a resolution out of its range names key, value and range."""
    path = tmp_path / "wrong.toml"
    path.write_text(BOUGHT.read_text(encoding="utf-8").replace("grades = true", "resolution_mm = -1"), encoding="utf-8")
    shown = doe("chain", str(path))
    assert shown.returncode == 2 and "allocate.resolution_mm" in shown.stderr and shown.stdout == ""


def test_command_line_a_study_whose_chain_misses_ends_with_one(tmp_path, monkeypatch):
    """Command line: a note before the runs, the contributions in the answer, exit code 1, and stated parts in the table of sizes."""
    instantly(monkeypatch.setattr)
    unillustrated(monkeypatch.setattr)
    roller = 'name = "roller_diameter"\ncoefficient = -1.0\nnominal_mm = 9.0\n'
    path = short_study(tmp_path, replace=(roller, f"{roller}upper_mm = 0.0063\nlower_mm = -0.0061\n"))
    shown = doe("study", str(path), "--out", str(tmp_path / "out"))
    assert shown.returncode == 1, shown.stderr
    why = "the fixed links consume 0.0124 mm of the closing link's 0.0100 mm"
    assert f"note: chain pocket will violate its limits: {why}" in shown.stderr
    assert f"Chain pocket: refused: {why}" in shown.stderr
    for words in ("Contributions to the scatter of the closing link, chain pocket", "violates its limits: "):
        assert words in shown.stdout, words
    table = (tmp_path / "out" / "part_dimensions.csv").read_text(encoding="utf-8")
    assert "pocket,roller_diameter,9.0,0.0063,-0.0061,,0.0,,stated" in table
    again = doe("study", str(path), "--out", str(tmp_path / "out"), "--json")
    record = json.loads(again.stdout)
    assert again.returncode == 1 and record["status"] == "missed" and list(record["missed_chains"]) == ["pocket"]


def test_chains_of_a_study_need_the_study(tmp_path):
    """Command line: ``doe chain`` of a study says where its chains are solved, not that other tables of the study are unknown keys."""
    study = tmp_path / "study.toml"
    study.write_text(
        '[scene]\nfile = "x.toml"\n[confirmation]\n[[factor]]\nname = "a"\n[[chain]]\nname = "radial"\nfactor = "a"\n'
    )
    with pytest.raises(
        InputError, match=r"study.toml: is a study, .*; run doe study, or write its chains to their own file"
    ):
        read_chains(study)
