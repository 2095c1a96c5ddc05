"""The report of the made-up study as a reader opens it in a browser."""

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from headless import offline_browser
from synthetic_study import motion, summary

from doe.report.page import html_report
from doe.report.summary import Summary

PICTURE = "return document.getElementById(arguments[0]).toDataURL()"


@contextmanager
def report_in_browser(folder: Path) -> Iterator[tuple[Any, Path]]:
    """A browser, and the folder with the page in a file."""
    (folder / "report.html").write_text(html_report(Summary.from_dict(summary()), motion()), encoding="utf-8")
    with offline_browser() as driver:
        yield driver, folder


def opened(browser: Any, scheme: str = "light", motion: str = "reduce", name: str = "report.html") -> Any:
    """The page as just opened, by a reader with these wishes."""
    driver, folder = browser
    wishes = {"prefers-color-scheme": scheme, "prefers-reduced-motion": motion}
    features = [{"name": name, "value": value} for name, value in wishes.items()]
    driver.execute_cdp_cmd("Emulation.setEmulatedMedia", {"features": features})
    driver.get((folder / name).as_uri())
    return driver


def text_of(page: Any, key: str) -> str:
    """What an element says."""
    return page.execute_script("return document.getElementById(arguments[0]).textContent", key)


def keys(page: Any, key: str, *pressed: str) -> None:
    """Press keys on an element."""
    page.find_element("id", key).send_keys(*pressed)
