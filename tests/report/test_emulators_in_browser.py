"""The emulators of a search in the report, used as a reader would in a headless browser: their figures are Python's."""

import re
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from report_page import PICTURE, keys, opened, report_in_browser, text_of
from short_studies import paper_study
from synthetic_study import CENTRE, FACTORS, RESPONSES, STEP, predicted, searched, summary

from doe.adaptive.emulators import Emulators, Runs, fit_emulators
from doe.pareto.search import Goals
from doe.report.page import html_report
from doe.report.summary import Summary
from doe.workflow.front_record import Emulated


@pytest.fixture(scope="module")
def browser(tmp_path_factory):
    """One headless browser for all tests, with the page in a file."""
    with report_in_browser(tmp_path_factory.mktemp("report")) as both:
        yield both


def with_emulators(record: dict[str, Any]) -> tuple[dict[str, Any], Emulators]:
    """The record as after a search whose region has grown at the end of the last factor, and its emulators."""
    random = np.random.default_rng(3)
    points = random.uniform(-1.0, 1.0, (24, 3))
    values = np.column_stack(
        [
            5.0 * np.sin(3.0 * np.log1p(0.42 * points[:, 0]) / 0.42) + points[:, 1],
            0.4 + 0.1 * points[:, 2] * points[:, 0],
            240.0 - 9.0 * points[:, 1] + 4.0 * np.cos(3.0 * points[:, 2]),
        ]
    )
    whole, errors = np.full((24, 3), 7), 0.02 * np.abs(values) * random.uniform(0.5, 1.0, (24, 3))
    runs, shares = Runs(points, values, errors, whole, np.full(24, 8)), (0.42, 0.0, 0.28)
    emulators = fit_emulators(Goals.of(["min"] * 3), runs, None, shares)
    assert shares in emulators.shares and () in emulators.shares
    study = paper_study()
    found = SimpleNamespace(search=SimpleNamespace(emulators=emulators))
    region = {each["name"]: [each["low"], each["high"]] for each in record["asked"]["factors"]}
    region[FACTORS[2]][1] += 0.1
    search = searched(Emulated.of(study, found).as_dict()) | {"region": region}
    return record | {"adaptive": search}, emulators


def test_oracle_scripts_evaluate_emulators_as_python_does(browser):
    """Oracle: means and deviations of `doe.adaptive.emulators` at points in and beyond the runs, in all responses."""
    driver, folder = browser
    record, emulators = with_emulators(summary())
    (folder / "emulated.html").write_text(html_report(Summary.from_dict(record)), encoding="utf-8")
    page = opened(browser, name="emulated.html")
    points = np.random.default_rng(4).uniform(-1.3, 1.3, (40, 3))
    points[:10] = emulators.runs.points[:10]
    half = record["adaptive"]["emulators"]["half_range"]
    found = page.execute_script(
        """const all = page.data.emulators;
        return Object.values(all.responses).map(one => arguments[0].map(factors => {
          const point = emulator.point(all, factors);
          return [emulator.mean(all, one, point), emulator.deviation(all, one, point)];
        }));""",
        (CENTRE + half * points).tolist(),
    )
    scale = 1e-8 * np.ptp(emulators.runs.values, axis=0)
    for column, each in enumerate(emulators.predict(points)):
        off = np.abs(np.array(found)[:, :, column].T - each)
        assert (off < scale).all(), off.max(axis=0)
    assert driver.get_log("browser") == []


def test_the_widget_switches_between_polynomial_and_emulator(browser):
    """Same colours for both, the emulator's deviation read out, nothing of it without a search."""
    from selenium.webdriver.support.ui import Select

    driver, folder = browser
    record, emulators = with_emulators(summary())
    (folder / "switched.html").write_text(html_report(Summary.from_dict(record)), encoding="utf-8")
    page = opened(browser, name="switched.html")
    page.find_element("id", "surface_pick").click()
    chosen = np.array(list(record["front"]["pick"]["factors"].values()))
    coded = (chosen - CENTRE) / record["adaptive"]["emulators"]["half_range"]
    (mean, *_), (deviation, *_) = (part[0] for part in emulators.predict(coded[None]))
    told = text_of(page, "surface_read")
    value, spread = re.match(r"impact force (\S+) N by the emulator, standard deviation (\S+) N; ", told).groups()
    assert float(value) == pytest.approx(mean, abs=deviation) and float(spread) == pytest.approx(deviation, rel=0.06)
    polynomial = predicted(RESPONSES[0], [(x - c) / s for x, c, s in zip(chosen, CENTRE, STEP, strict=True)])
    assert f"; {polynomial:.2f} ± " in told and " N by the polynomial; at radial" in told
    page.find_element("id", "surface_pick").click()
    maps = []
    for by in ("polynomial", "emulator"):
        Select(page.find_element("id", "surface_by")).select_by_visible_text(by)
        maps.append(page.execute_script(PICTURE, "surface_map"))
    assert maps[0] != maps[1]
    # The axis goes as far as the search went, the polynomial does not.
    keys(page, "surface_y", "pocket")
    keys(page, "surface_map", *["\ue013"] * 41)
    assert "not known to the polynomial" in text_of(page, "surface_read")
    assert "pocket clearance 0.48409 mm" in text_of(page, "surface_read")
    assert driver.get_log("browser") == []
    plain = opened(browser)
    assert plain.find_elements("id", "surface_by") == [] and "emulator" not in plain.find_element("id", "surface").text
