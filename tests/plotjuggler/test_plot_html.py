"""Plots as HTML, in a browser that has no network."""

from __future__ import annotations

import os
import shutil
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy
import pytest

from rosidl_adapter_proto.plotjuggler.plot import Plot
from rosidl_adapter_proto.plotjuggler.plot_html import write_html
from tests.plotjuggler.plots import SECONDS, one, plot, three

NAN = float("nan")


@pytest.fixture(scope="module")
def browser() -> Iterator[Any]:
    """A browser; where there is none, the test is skipped, but where every test has to run it fails."""
    chromium = shutil.which("chromium")
    if chromium is None:
        if "CI" in os.environ:
            pytest.fail("needs chromium")
        pytest.skip("needs chromium")
    from playwright.sync_api import sync_playwright

    with sync_playwright() as playwright:
        running = playwright.chromium.launch(executable_path=chromium, args=["--no-sandbox"])
        yield running
        running.close()


class Page:
    """A page of a plot.

    Attributes:
        page: The page in the browser.
        file: The file that it is.
        events: Everything that the browser asked for, and everything that it complained about.
    """

    def __init__(self, browser: Any, drawn: Plot, folder: Path) -> None:
        self.file = folder / "x.html"
        write_html(drawn, self.file)
        context = browser.new_context(viewport={"width": 1200, "height": 700})
        context.set_offline(True)
        self.page = context.new_page()
        self.events: list[str] = []
        self.page.on("console", lambda message: self.events.append(f"console: {message.text}"))
        self.page.on("pageerror", lambda error: self.events.append(f"error: {error}"))
        self.page.on("request", lambda request: self.events.append(request.url))
        self.page.goto(self.file.as_uri())
        self.wait_for("plot?._fullLayout?.xaxis?.range")

    def plotly(self, expression: str) -> Any:
        """Return what Plotly knows of the plot."""
        return self.page.evaluate(
            f"() => {{ const plot = document.getElementById('plot'); return {expression} }}"
        )

    def wait_for(self, condition: str) -> None:
        """Wait until something is so of the plot; Playwright's own way is refused by the policy of the page."""
        look = f"() => ({condition}) ? done() : requestAnimationFrame(look)"
        self.plotly(f"new Promise(done => {{ const look = {look}; look() }})")

    def place(self, across: float, up: float) -> tuple[float, float]:
        """Return a place in the plot, of which the lower left is 0, 0 and the upper right 1, 1, in pixels."""
        box = self.page.locator(".nsewdrag").first.bounding_box()
        return box["x"] + across * box["width"], box["y"] + (1 - up) * box["height"]

    def texts(self, selector: str) -> list[str]:
        return [
            each.replace("\N{ZERO WIDTH SPACE}", "")
            for each in self.page.locator(selector).all_text_contents()
        ]


@pytest.fixture(scope="module")
def page(browser: Any, tmp_path_factory: pytest.TempPathFactory) -> Iterator[Page]:
    """The page of three series. No test leaves anything in it that others see."""
    opened = Page(browser, plot(*three()), tmp_path_factory.mktemp("page"))
    yield opened
    opened.page.context.close()


def test_the_page_needs_nothing_but_itself(page: Page) -> None:
    assert page.events == [page.file.as_uri()]
    assert page.page.title() == "recording"


def test_it_sends_nothing(page: Page) -> None:
    titles = page.page.locator(".modebar-btn").evaluate_all(
        "all => all.map(one => one.getAttribute('data-title'))"
    )
    assert titles == [
        "Download plot as a PNG",
        "Zoom",
        "Pan",
        "Zoom in",
        "Zoom out",
        "Autoscale",
        "Reset axes",
    ]

    asked = "fetch('https://example.com').then(() => 'sent', () => 'refused')"
    assert page.page.evaluate(asked) == "refused"
    assert page.events.pop().startswith("console: Fetch API cannot load https://example.com")
    while page.events[1:]:
        page.events.pop()


def test_labels_and_legend(page: Page) -> None:
    assert page.texts(".legendtext") == [
        "/imu/linear_acceleration/z",
        "/imu/linear_acceleration/x",
        "/battery/charging",
    ]
    assert page.texts(".xtitle") == ["seconds since 2023-11-14 22:13:20.000 UTC"]
    assert page.texts(".gtitle") == ["recording"]


def test_every_value_is_there(page: Page) -> None:
    for index, each in enumerate(three()):
        values = page.plotly(f"Array.from(plot._fullData[{index}].y, String)")
        numpy.testing.assert_array_equal(numpy.array(values, float), each.values)
    assert page.plotly("plot._fullData.map(each => each.line.shape)") == ["linear", "linear", "hv"]
    assert page.plotly("plot._fullData.map(each => each.connectgaps)") == [False] * 3


def test_a_click_on_the_legend_hides_a_series(page: Page) -> None:
    lines = page.page.locator(".scatterlayer .trace")
    assert lines.count() == 3

    page.page.locator(".legendtoggle").nth(1).click()
    page.wait_for("plot._fullData[1].visible === 'legendonly'")
    assert lines.count() == 2
    page.page.locator(".legendtoggle").nth(1).click()
    page.wait_for("plot._fullData[1].visible === true")
    assert lines.count() == 3


def test_dragging_zooms(page: Page) -> None:
    assert page.plotly("plot._fullLayout.xaxis.range") == pytest.approx([0, 9.99], abs=0.01)

    mouse = page.page.mouse
    mouse.move(*page.place(0.2, 0.2))
    mouse.down()
    mouse.move(*page.place(0.4, 0.5), steps=5)
    mouse.up()
    page.wait_for("plot._fullLayout.xaxis.range[0] > 1")
    assert page.plotly("plot._fullLayout.xaxis.range") == pytest.approx([2, 4], abs=0.05)
    mouse.dblclick(*page.place(0.5, 0.5))
    page.wait_for("plot._fullLayout.xaxis.range[0] < 1")


# In a page of its own, since what the mouse has done there before may still be shown.
def test_the_mouse_shows_time_and_values(browser: Any, tmp_path: Path) -> None:
    page = Page(browser, plot(*three()), tmp_path)
    page.page.mouse.move(*page.place(0.3, 0.5))
    page.page.locator(".hoverlayer .legend").wait_for()

    assert page.texts(".hoverlayer .legendtitletext") == ["3.000000 s"]
    height, across = 9.81 + 0.3 * numpy.sin(9), 3 * numpy.cos(3)
    assert page.texts(".hoverlayer .legendtext") == [
        f"/imu/linear_acceleration/z : {height:.8f}",
        f"/imu/linear_acceleration/x : \N{MINUS SIGN}{-across:.8f}",
        "/battery/charging : 1",
    ]
    page.page.context.close()


def test_many_values_are_thinned_and_the_page_says_so(browser: Any, tmp_path: Path) -> None:
    values = numpy.sin(numpy.arange(10**6) / 10**5)
    values[777_777] = 9.0
    page = Page(browser, plot(one("/a", "/b", values)), tmp_path)

    assert page.file.stat().st_size < 6_000_000
    assert page.texts(".gtitle") == [
        "recordingseries of more than 10,000 values: "
        "drawn are the smallest and the largest in each of 5,000 spans of time"
    ]
    assert page.plotly("Math.max(...plot._fullData[0].y)") == 9
    page.page.context.close()


@pytest.mark.parametrize(
    "values",
    [[3.0], [NAN, NAN], [5e-324, 2e-300], [1e300, -1e300], [1.0, 1.0 + 2**-52]],
    ids=["one", "none", "small", "large", "close"],
)
def test_odd_values_are_drawn(values: list[float], browser: Any, tmp_path: Path) -> None:
    page = Page(browser, plot(one("/a", "/b", values)), tmp_path)

    assert page.events == [page.file.as_uri()]
    drawn = numpy.array(page.plotly("Array.from(plot._fullData[0].y, String)"), float)
    numpy.testing.assert_allclose(drawn, values, rtol=0, atol=1e-300)
    page.page.context.close()


def test_names_are_shown_as_they_are(browser: Any, tmp_path: Path) -> None:
    names = [
        "/a/<b>x</b>",
        "/a/</script><script>document.title = 'taken'</script>",
        "/a/<a href='https://example.com'>x</a>",
        "/a/$x^2$",
        "/a/&lt;{}%{y}",
    ]
    title = " ".join(names[:2])
    page = Page(browser, plot(*(one("/a", name[2:], SECONDS) for name in names), title=title), tmp_path)

    assert page.events == [page.file.as_uri()]
    assert page.texts(".legendtext") == names
    assert page.texts(".gtitle") == [page.page.title()] == [title]
    page.page.context.close()
