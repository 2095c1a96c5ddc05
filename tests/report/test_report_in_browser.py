"""The report in a real browser without a network: it draws, turns, slides, plays, prints, and keys reach all of it."""

import base64
import json
import math
import re

import numpy as np
import pytest
from headless import as_wide_as, widths
from report_page import PICTURE, keys, opened, report_in_browser, text_of
from synthetic_study import CENTRE, FACTORS, RESPONSES, STEP, predicted, summary

from doe.report.page import html_report
from doe.report.summary import Summary
from rbdyn.base.words import with_error


@pytest.fixture(scope="module")
def browser(tmp_path_factory):
    """One headless browser for all tests, with the page in a file."""
    with report_in_browser(tmp_path_factory.mktemp("report")) as both:
        yield both


def test_opens_offline_with_the_answer_and_no_complaint(browser):
    page = opened(browser)
    answer = page.find_element("id", "answer")
    for words in ("radial clearance", "0.0225", "The gain is real", "9.240 0/-0.005", "11.16"):
        assert words in answer.text
    # Found without scrolling.
    assert page.find_element("css selector", ".tiles").rect["y"] < 200
    assert page.execute_script("return performance.getEntriesByType('resource').length") == 0
    assert page.get_log("browser") == []


def test_two_factors_of_awkward_names_draw_as_they_are(browser):
    driver, folder = browser
    texts = json.dumps(summary()).replace(FACTORS[0], "</script><b>x</b>")
    record = json.loads(texts, object_hook=lambda table: {key: table[key] for key in table if key != FACTORS[2]})
    del record["asked"]["factors"][2]
    for fitted in record["fit"]["responses"].values():
        terms = {"1": 1.0, "A": 2.0, "B": 0.5}
        fitted |= {
            "coefficients": terms,
            "terms": list(terms),
            "covariance": np.diag([0.01] * 3).tolist(),
            "vif": {"A": 1.0, "B": 1.0},
        }
        fitted |= {"actual_coefficients": terms, "stationary_point": None}
    (folder / "awkward.html").write_text(html_report(Summary.from_dict(record)), encoding="utf-8")
    page = opened(browser, name="awkward.html")
    assert "</script><b>x</b>" in page.find_element("id", "surface_x").text
    assert page.find_elements("css selector", "main b") == []
    assert driver.get_log("browser") == []


def test_surface_turns_by_drag_and_by_keys(browser):
    from selenium.webdriver import ActionChains, Keys

    page = opened(browser)
    canvas = page.find_element("id", "surface_3d")
    pictures = [page.execute_script(PICTURE, "surface_3d")]
    for pressed in (Keys.ARROW_LEFT, Keys.ARROW_UP):
        canvas.send_keys(pressed)
        pictures.append(page.execute_script(PICTURE, "surface_3d"))
    ActionChains(page).move_to_element(canvas).click_and_hold().move_by_offset(60, 20).release().perform()
    pictures.append(page.execute_script(PICTURE, "surface_3d"))
    assert len(set(pictures)) == 4
    # Back by the same keys, back to the same picture.
    for pressed in (Keys.ARROW_RIGHT, Keys.ARROW_LEFT):
        canvas.send_keys(pressed)
    assert page.execute_script(PICTURE, "surface_3d") == pictures[3]


def test_surface_reads_out_the_fitted_values(browser):
    from selenium.webdriver import Keys

    page = opened(browser)
    chosen = summary()["front"]["pick"]["factors"]
    coded = [(chosen[name] - c) / s for name, c, s in zip(FACTORS, CENTRE, STEP, strict=True)]
    page.find_element("id", "surface_pick").click()
    assert f"impact force {predicted(RESPONSES[0], coded):.2f} ± " in text_of(page, "surface_read")
    keys(page, "surface_response", "power")
    assert f"power loss {predicted(RESPONSES[2], coded):.2f} ± " in text_of(page, "surface_read")
    before = page.execute_script(PICTURE, "surface_map")
    keys(page, "surface_map", Keys.ARROW_RIGHT)
    assert page.execute_script(PICTURE, "surface_map") != before
    # The slider of the factor that is no axis.
    page.execute_script("""
        const slider = document.querySelector("#surface_others input");
        slider.value = slider.max;
        slider.dispatchEvent(new Event("input"));""")
    assert "pocket clearance 0.38409 mm" in text_of(page, "surface_read")


def test_scripts_evaluate_terms_transforms_and_contours(browser):
    page = opened(browser)
    surface = {"terms": ["1", "A", "BC", "A^2B"], "coefficients": [1.0, 2.0, -1.0, 0.5]}
    value = "return model.value(arguments[0], [2, 3, -1])"
    # 1 + 4 + 3 + 6
    assert page.execute_script(value, surface | {"power": None}) == pytest.approx(14.0)
    # The way back from Box and Cox: (lambda t + 1)^(1/lambda), e^t for lambda = 0.
    assert page.execute_script(value, surface | {"power": 0.5}) == pytest.approx(8.0**2)
    assert page.execute_script(value, surface | {"power": 0.0}) == pytest.approx(math.exp(14.0))
    line = {"terms": ["1", "A"], "coefficients": [1.0, 2.0], "power": None}
    line |= {"covariance": [[4.0, 1.0], [1.0, 8.0]], "student": 2.0}
    # 2 sqrt(4 + 2 0.5 + 8 0.25)
    half = page.execute_script("return model.half_width(arguments[0], [0.5])", line)
    assert half == pytest.approx(2.0 * math.sqrt(7.0))
    cut = page.execute_script("return contours.segments([[0, 0, 0], [1, 1, 1], [2, 2, 2]], 1.25)")
    assert sorted(place for segment in cut for place in segment) == [[1.25, 0], [1.25, 1], [1.25, 1], [1.25, 2]]


def test_unit_scripts_write_values_with_errors_as_the_tables_do(browser):
    """Unit: the page's scripts round a value with its error exactly as its tables."""
    page = opened(browser)
    cases = [(231.472, 0.0057), (5.0, 0.0996), (1234.5, 99.6), (2.5e9, 1.23e7), (2.31e-12, 1.24e-13), (-1e-9, 0.03)]
    script = "return arguments[0].map(([value, error]) => page.with_error(value, error))"
    assert page.execute_script(script, cases) == [with_error(*case) for case in cases]


def test_axes_of_a_surface_never_coincide(browser):
    page = opened(browser)
    keys(page, "surface_y", "radial")
    script = "return ['surface_x', 'surface_y'].map(name => document.getElementById(name).value)"
    x, y = page.execute_script(script)
    assert y == "0" and x != y
    assert page.get_log("browser") == []


def place_of(page, picture: int, number: int) -> tuple[float, float]:
    """Where a point of the first front is in a picture, in its units; over parallel axes on the last of them."""
    axes = page.execute_script(
        "return document.querySelectorAll('svg[data-front]')[arguments[0]].dataset.front", picture
    )
    told, (left, upper, right, lower) = json.loads(axes), json.loads(axes)["frame"]
    points = sorted(summary()["front"]["front"], key=lambda each: each["responses"][RESPONSES[0]])
    values = list(points[number]["responses"].values())
    shares = [(values[place] - low) / (high - low) for kind, place, low, high in told["axes"] if kind == "responses"]
    across = shares[0] if told["kind"] == "pair" else 1.0 - 0.5 / len(told["axes"])
    return left + (right - left) * across, lower - (lower - upper) * shares[-1]


def click(page, picture: int, number: int) -> None:
    """Click on a point of the first front in a picture."""
    from selenium.webdriver.common.action_chains import ActionChains

    svg = page.find_elements("css selector", "svg[data-front]")[picture]
    width, height = page.execute_script("const box = arguments[0].viewBox.baseVal; return [box.width, box.height]", svg)
    u, v = place_of(page, picture, number)
    scale = svg.rect["width"] / width
    # From the middle of the picture.
    ActionChains(page).move_to_element_with_offset(
        svg, scale * (u - 0.5 * width), scale * (v - 0.5 * height)
    ).click().perform()


def test_front_slider_shows_the_points_of_the_front(browser):
    from selenium.webdriver import Keys

    page = opened(browser)
    points = sorted(summary()["front"]["front"], key=lambda each: each["responses"][RESPONSES[0]])
    keys(page, "front_slider", Keys.HOME)
    for number in (0, 1, 2):
        rows = page.execute_script(
            "return [...document.querySelectorAll('#front_point tbody tr')].map(row => row.cells[1].textContent)"
        )
        for place, name in enumerate(FACTORS):
            assert float(rows[place].split()[0]) == pytest.approx(points[number]["factors"][name], abs=5e-5)
        for place, name in enumerate(RESPONSES, len(FACTORS)):
            value, error = (float(each) for each in rows[place].split(" ± "))
            assert value == pytest.approx(points[number]["responses"][name], abs=error)
            assert error == pytest.approx(points[number]["errors"][name], rel=0.06)
        # The same point is ringed in each picture.
        rings = page.execute_script("""
            return [...document.querySelectorAll("svg[data-front]")].map(svg => {
              const mark = svg.querySelector(".chosen"), pair = mark.matches("circle");
              const first = pair ? [mark.getAttribute("cx"), mark.getAttribute("cy")] : mark.getAttribute("points").split(" ").at(-1).split(",");
              return first.map(Number);
            });""")
        assert rings == pytest.approx(np.array([place_of(page, picture, number) for picture in range(4)]), abs=0.06)
        keys(page, "front_slider", Keys.ARROW_RIGHT)
    assert text_of(page, "front_number") == "4 of 12"


def test_click_on_a_point_chooses_it(browser):
    page = opened(browser)
    page.execute_script("document.getElementById('pairs').scrollIntoView()")
    click(page, 0, 9)
    assert text_of(page, "front_number") == "10 of 12"
    keys(page, "front_set", "with")
    assert text_of(page, "front_number") == "1 of 6"
    assert "with tolerances" in text_of(page, "front_point")


def test_bearing_moves_while_it_plays(browser):
    from selenium.webdriver.support.ui import WebDriverWait

    page = opened(browser)
    button = page.find_element("id", "bearing_play")
    picture = "return document.querySelector('#bearing canvas').toDataURL()"
    still = page.execute_script(picture)
    assert button.text == "Play"
    button.click()
    assert button.text == "Pause"
    WebDriverWait(page, 5).until(lambda _: page.execute_script(picture) != still)
    button.click()
    stopped = page.execute_script(picture)
    moment = page.find_element("id", "bearing_moment").get_property("value")
    assert stopped != still
    # Two more frames of the screen change nothing.
    page.execute_async_script("requestAnimationFrame(() => requestAnimationFrame(arguments[0]))")
    assert page.find_element("id", "bearing_moment").get_property("value") == moment
    assert page.execute_script(picture) == stopped


@pytest.mark.parametrize(("wish", "begins"), [("reduce", False), ("no-preference", True)])
def test_motion_begins_by_itself_only_where_it_is_welcome(browser, wish, begins):
    page = opened(browser, motion=wish)
    page.execute_script("document.getElementById('bearing').scrollIntoView({behavior: 'instant'})")
    page.execute_async_script("""
        const done = arguments[0];
        new IntersectionObserver(() => setTimeout(done, 50)).observe(document.getElementById("bearing_play"));""")
    pressed = page.find_element("id", "bearing_play").get_attribute("aria-pressed")
    assert pressed == ("true" if begins else "false")


def test_tab_reaches_every_control_and_shows_it(browser):
    from selenium.webdriver import Keys

    page = opened(browser)
    page.execute_script("""
        window.reached = {};
        document.addEventListener("focusin", event => {
          window.reached[event.target.id || event.target.outerHTML] = getComputedStyle(event.target).outlineStyle;
        });""")
    page.find_element("tag name", "body").send_keys(Keys.TAB * 60)
    reached = page.execute_script("return window.reached")
    assert "none" not in reached.values()
    assert {
        *("surface_response", "surface_x", "surface_y", "surface_baseline", "surface_pick", "surface_3d", "surface_map"),
        *("front_set", "front_slider", "bearing_play", "bearing_moment", "bearing_speed", "bearing_magnify"),
    } <= set(reached)  # fmt: skip


def test_prints_in_light_on_several_pages(browser):
    page = opened(browser, scheme="dark")
    # What stands on paper is drawn anew in light colours before printing, and in dark ones again after.
    paper = "return [page.colour('paper'), document.querySelectorAll('details[open]').length]"
    dark = page.execute_script(paper)
    printed = page.execute_cdp_cmd("Page.printToPDF", {"preferCSSPageSize": True})
    pages = len(re.findall(rb"/Type\s*/Page\b", base64.b64decode(printed["data"])))
    assert 4 <= pages <= 40
    assert page.execute_script(paper) == dark == ["rgb(21, 25, 29)", 0]
    page.execute_script("dispatchEvent(new Event('beforeprint'))")
    assert page.execute_script(paper) == ["rgb(255, 255, 255)", 1]


def test_narrow_screen_needs_no_sideways_scrolling(browser):
    page = opened(browser)
    with as_wide_as(page, 400):
        wide, room = widths(page)
        assert wide == room <= 400
        assert page.find_element("css selector", ".tile").rect["y"] < 250


def test_tables_sort_by_a_column(browser):
    page = opened(browser)
    column = "return [...document.querySelectorAll('#design table')[0].tBodies[0].rows].map(row => parseFloat(row.cells[5].textContent))"
    before = page.execute_script(column)
    (head,) = (each for each in page.find_elements("css selector", "#design .sort") if each.text == "impact force [N]")
    head.click()
    assert page.execute_script(column) == sorted(before) != before
    head.click()
    assert page.execute_script(column) == sorted(before, reverse=True)


def test_without_scripts_tables_and_static_pictures_are_there(browser):
    driver, _ = browser
    driver.execute_cdp_cmd("Emulation.setScriptExecutionDisabled", {"value": True})
    try:
        page = opened(browser)
        assert "Scripts are off" in page.find_element("tag name", "noscript").text
        assert "0.0225" in page.find_element("id", "answer").text
        assert page.find_element("css selector", "#pairs svg").is_displayed()
        assert not page.find_element("id", "surface").is_displayed()
    finally:
        driver.execute_cdp_cmd("Emulation.setScriptExecutionDisabled", {"value": False})


@pytest.mark.parametrize("width", [400, 1200])
def test_wide_pictures_stay_legible(browser, width):
    """Their smallest letters have 6 px at least: on a narrow page they scroll in a box of their own, and the page does not."""
    page = opened(browser)
    size = {"width": width, "height": 900, "deviceScaleFactor": 1, "mobile": False}
    page.execute_cdp_cmd("Emulation.setDeviceMetricsOverride", size)
    try:
        found = page.execute_script(
            "return [...document.querySelectorAll('svg.wide')].map(each => [each.getBoundingClientRect().width"
            " / each.viewBox.baseVal.width, each.parentElement.clientWidth, document.documentElement.scrollWidth])"
        )
    finally:
        page.execute_cdp_cmd("Emulation.clearDeviceMetricsOverride", {})
    assert len(found) >= 2
    for scale, box, whole in found:
        assert 10.0 * scale >= 6.0 and box <= whole <= width
