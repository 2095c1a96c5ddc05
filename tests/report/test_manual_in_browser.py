"""The manual in a real browser without a network: opens, finds, fits a phone, prints."""

import base64
import re

import pytest
from headless import as_wide_as, offline_browser, widths
from manual_parts import whole_page


@pytest.fixture(scope="module")
def manual(tmp_path_factory):
    """The page, open."""
    path = tmp_path_factory.mktemp("manual") / "manual.html"
    path.write_text(whole_page(), encoding="utf-8")
    with offline_browser() as driver:
        driver.get(path.as_uri())
        yield driver


def reached(manual) -> bool:
    """Whether the place that the address names stands within the window."""
    return manual.execute_script("""
        const place = document.getElementById(decodeURIComponent(location.hash.slice(1))).getBoundingClientRect();
        return place.top > -5 && place.top < innerHeight;""")


def test_opens_offline_without_complaint(manual):
    assert manual.execute_script("return performance.getEntriesByType('resource').length") == 0
    assert manual.get_log("browser") == []


def test_contents_lead_somewhere(manual):
    links = manual.find_elements("css selector", "#contents summary a, #contents li > a")
    assert len(links) > 10
    for link in links:
        link.click()
        assert link.get_attribute("href").endswith(manual.execute_script("return location.hash"))
        assert reached(manual), link.text


def test_search_finds_a_key_by_name_and_by_words(manual):
    box = manual.find_element("id", "search")
    for typed in ("cage.pocket_clearance_mm", "pocket width roller diameter"):
        box.clear()
        box.send_keys(typed)
        found = manual.find_elements("css selector", "#found a")
        assert not manual.find_element("id", "contents").is_displayed()
        (key,) = [link for link in found if link.text == "cage.pocket_clearance_mm"]
        key.click()
        assert reached(manual)
    box.clear()
    box.send_keys("qqqq")
    assert manual.find_element("id", "count").text == "0 places"
    box.clear()
    box.send_keys(" ")
    assert manual.find_element("id", "contents").is_displayed()
    assert manual.get_log("browser") == []


@pytest.mark.parametrize("width", [400, 1200])
def test_no_sideways_scrolling(manual, width):
    with as_wide_as(manual, width):
        wide, room = widths(manual)
        assert wide == room <= width


def test_prints_light_without_contents(manual):
    features = [{"name": "prefers-color-scheme", "value": "dark"}]
    manual.execute_cdp_cmd("Emulation.setEmulatedMedia", {"features": features})
    paper = "return getComputedStyle(document.body).backgroundColor"
    assert manual.execute_script(paper) == "rgb(21, 25, 29)"
    manual.execute_cdp_cmd("Emulation.setEmulatedMedia", {"media": "print", "features": features})
    assert manual.execute_script(paper) == "rgb(255, 255, 255)"
    assert not manual.find_element("tag name", "nav").is_displayed()
    printed = manual.execute_cdp_cmd("Page.printToPDF", {"preferCSSPageSize": True})
    assert len(re.findall(rb"/Type\s*/Page\b", base64.b64decode(printed["data"]))) < 200
    manual.execute_cdp_cmd("Emulation.setEmulatedMedia", {"media": "", "features": []})
