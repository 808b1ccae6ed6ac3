"""A page in a browser: Chromium by playwright, and what every page must hold to there.

Whoever imports it is skipped where either is not installed.
"""

import shutil
from pathlib import Path

import pytest

CHROMIUM = next(filter(None, map(shutil.which, ("chromium", "chromium-browser", "google-chrome"))), None)
if CHROMIUM is None:
    pytest.skip("there is no Chromium (on Debian: apt-get install chromium)", allow_module_level=True)
api = pytest.importorskip("playwright.sync_api", reason="playwright (the extra test) is not installed")

BEYOND = """() => [...document.querySelectorAll("body *")].filter(one => {
  const style = getComputedStyle(one), box = one.getBoundingClientRect();
  const apart = one.closest(".scroll, .plot, .skip, #js-plotly-tester");
  if (apart || style.display === "inline" || !box.width) return false;
  const spilt = one.scrollWidth > one.clientWidth + 1 && one.clientWidth > 0 && style.overflowX === "visible";
  return box.right > innerWidth + 1 || box.left < -1 || spilt;
}).map(one => one.tagName + " " + one.className + ": " + one.textContent.slice(0, 40))"""
"""What reaches beyond the window, or beyond its own box without a scroll bar."""

UNDRAWN = """() => [...document.querySelectorAll(".plot")].filter(place => {
  const values = trace => trace.z ? trace.z.flat() : trace.y ?? [];
  const points = (place.data ?? []).map(trace => values(trace).filter(v => v !== null).length);
  return !place.querySelector("svg.main-svg") || !points.length || Math.min(...points) < 2;
}).map(place => place.closest("figure").textContent.slice(0, 60))"""
"""Figures without an image or with a curve of no points."""


UNSEEN = """() => [...document.querySelectorAll(".circuit")].filter(circuit => {
  const window = circuit.closest(".scroll").getBoundingClientRect();
  return ![...circuit.querySelectorAll(".marked")].some(one => {
    const at = one.getBoundingClientRect();
    return at.left >= window.left && at.right <= window.right;
  });
}).length"""
"""Drawings of a circuit of which no marked part is in view, until the reader scrolls sideways."""

FIGURE = "number => document.querySelectorAll('.plot')[number]"


def scrolled_through(page) -> None:
    """As a reader does who waits at every figure: one that a busy machine scrolls past between two frames
    has not come near."""
    for number in range(page.locator(".plot").count()):
        page.evaluate(FIGURE + ".scrollIntoView({block: 'center'})", number)
        page.wait_for_function(FIGURE + ".dataset.drawn", arg=number)


def holds_whole(page, width: int) -> None:
    """Every figure is drawn with data, and nothing reaches beyond the edge, folded tables opened too."""
    scrolled_through(page)
    assert page.evaluate(UNDRAWN) == []
    assert page.evaluate(UNSEEN) == 0
    page.evaluate("document.querySelectorAll('details').forEach(one => { one.open = true; })")
    assert page.evaluate("document.documentElement.scrollWidth") <= width
    assert page.evaluate(BEYOND) == []


def shown_whole(file: Path, width: int) -> None:
    """A file in a browser of its own: as `holds_whole`, and nothing is complained of."""
    with api.sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=CHROMIUM, args=["--no-sandbox"])
        page = browser.new_page(viewport={"width": width, "height": 800})
        told: list[str] = []
        page.on("console", lambda message: told.append(message.text))
        page.on("pageerror", lambda error: told.append(str(error)))
        page.goto(file.as_uri())
        holds_whole(page, width)
        browser.close()
    assert told == []
