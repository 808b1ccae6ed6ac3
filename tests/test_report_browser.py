"""The pages in a real browser, as wide as a desk's and as a telephone's: drawn, zoomed, nothing cut off."""

from dataclasses import replace
from functools import partial
from pathlib import Path

import pytest

from browser import CHROMIUM, api, holds_whole, scrolled_through
from campaigns import CAMPAIGNS
from diagnosed import diagnosed
from forklift import Campaign, Truck, commands, compare, simulate
from forklift.base.output import write_text
from forklift.diagnosis.diagnose import diagnose
from forklift.diagnosis.result import Diagnosis
from forklift.report.of_simulation import simulation_page
from test_plant_report import line, recorded

PAGES = ("diagnosis", "fit", "comparison", "simulation", "plant")
WIDTHS = (1280, 390)
EXPLORED = PAGES[:3]

RANGE = "place => place._fullLayout.xaxis.range"


@pytest.fixture(scope="module")
def browser():
    with api.sync_playwright() as playwright:
        found = playwright.chromium.launch(executable_path=CHROMIUM, args=["--no-sandbox"])
        yield found
        found.close()


@pytest.fixture(scope="module")
def files(tmp_path_factory, null_fit):
    """Each page, as its result writes it."""
    folder = tmp_path_factory.mktemp("pages")
    null, thesis = Campaign.read(CAMPAIGNS / "null"), Truck.read("thesis")
    prms = commands.generate("prms", "free", duration_s=6.0, seed=2)
    lowered = simulate(thesis, prms, load_kg=800.0, oil_temperature_degc=40.0)
    return {
        "diagnosis": diagnosed("leak").write(folder / "diagnosis") / "report.html",
        "fit": null_fit.write(folder / "fit") / "report.html",
        "comparison": compare(null, thesis).write(folder / "comparison") / "report.html",
        "plant": bent().write(folder / "plant") / "report.html",
        "simulation": write_text(folder / "simulation.html", simulation_page(lowered)),
    }


def bent() -> Diagnosis:
    """Of a machine with two outputs, two inputs, and samples alone between gaps."""
    plant = line()
    return diagnose(plant, recorded(plant), candidates=[replace(one, y={}) for one in recorded(plant)])


@pytest.fixture
def opened(browser, files):
    """Opens a page and, when the test is over, sees that nothing was complained of or fetched."""
    contexts, told = [], []

    def open_page(name: str, width: int = 1280, scheme: str = "light"):
        context = browser.new_context(viewport={"width": width, "height": 800}, color_scheme=scheme)
        contexts.append(context)
        page = context.new_page()
        page.on("console", lambda message: told.append(f"{message.type}: {message.text}"))
        page.on("pageerror", lambda error: told.append(str(error)))
        page.on("request", partial(_note_request, told, files[name]))
        page.goto(files[name].as_uri())
        return page

    yield open_page
    for context in contexts:
        context.close()
    assert told == []


def _note_request(told: list[str], file: Path, request) -> None:
    if request.url.partition("#")[0] != file.as_uri() and not request.url.startswith(("data:", "blob:")):
        told.append(f"fetched {request.url}")


@pytest.mark.parametrize("width", WIDTHS)
@pytest.mark.parametrize("name", PAGES)
def test_every_figure_is_drawn_with_data_and_nothing_reaches_beyond_the_edge(opened, name, width):
    page = opened(name, width)
    holds_whole(page, width)


def test_figures_far_below_wait_until_they_come_near(opened):
    page = opened("diagnosis")
    page.wait_for_function("document.querySelector('.explorer .plot').dataset.drawn")
    assert not page.evaluate("[...document.querySelectorAll('.plot')].at(-1).dataset.drawn")


def test_the_first_screen_holds_the_answers(opened):
    page = opened("diagnosis")
    assert page.locator("h1").bounding_box()["y"] < 150
    bottom = page.locator(".facts").bounding_box()
    assert bottom["y"] + bottom["height"] < 800


@pytest.mark.parametrize("name", EXPLORED)
def test_dragging_zooms_and_a_double_click_shows_all_again(opened, name):
    page = opened(name)
    place = page.locator(".explorer .plot")
    place.scroll_into_view_if_needed()
    page.wait_for_function("document.querySelector('.explorer .plot').dataset.drawn")
    before = place.evaluate(RANGE)
    box = place.bounding_box()
    y = box["y"] + 0.25 * box["height"]
    page.mouse.move(box["x"] + 0.4 * box["width"], y)
    page.mouse.down()
    page.mouse.move(box["x"] + 0.6 * box["width"], y, steps=5)
    page.mouse.up()
    page.wait_for_function(
        f"before => ({RANGE})(document.querySelector('.explorer .plot'))[0] > before + 1", arg=before[0]
    )
    near = place.evaluate(RANGE)
    assert near[1] - near[0] < 0.4 * (before[1] - before[0])
    double_clicked_until(
        page,
        (box["x"] + 0.5 * box["width"], y),
        f"before => Math.abs(({RANGE})(document.querySelector('.explorer .plot'))[0] - before) < 0.1",
        before[0],
    )


def double_clicked_until(page, at, shows, given):
    """A double click whose halves a busy machine delivers further apart than a plot allows is two clicks:
    then it is made again, as anyone would."""
    for _ in range(5):
        page.mouse.dblclick(*at)
        try:
            return page.wait_for_function(shows, arg=given, timeout=4000)
        except api.TimeoutError:
            continue
    raise AssertionError("five double clicks did not show it")


def test_the_keyboard_alone_zooms_and_changes_recording_and_signal(opened):
    page = opened("diagnosis")
    place = page.locator(".explorer .plot")
    page.wait_for_function("document.querySelector('.explorer .plot').dataset.drawn")
    before = place.evaluate(RANGE)
    zoom = page.get_by_role("button", name="Zoom in")
    zoom.focus()
    assert zoom.evaluate("one => getComputedStyle(one).outlineStyle") != "none"
    page.keyboard.press("Enter")
    near = place.evaluate(RANGE)
    assert near[1] - near[0] == pytest.approx(0.5 * (before[1] - before[0]), rel=0.01)
    told = page.locator(".explorer .conditions")
    said = told.text_content()
    page.locator(".explorer [data-choose=signal]").focus()
    page.keyboard.press("ArrowUp")
    assert told.text_content() != said
    assert place.evaluate(RANGE) == pytest.approx(near)  # another signal of the same moment
    page.locator(".explorer [data-choose=recording]").focus()
    page.keyboard.press("ArrowDown")
    assert place.evaluate(RANGE)[1] == pytest.approx(before[1], rel=0.3)
    page.get_by_role("button", name="See all").focus()
    page.keyboard.press("Space")
    assert place.evaluate(RANGE)[0] == pytest.approx(before[0], abs=0.1)


def test_another_input_is_drawn_below_and_a_sample_alone_is_a_dot(opened):
    page = opened("plant")
    place = page.locator(".explorer .plot")
    page.wait_for_function("document.querySelector('.explorer .plot').dataset.drawn")
    titles = "place => ['yaxis', 'yaxis3'].map(name => place._fullLayout[name].title.text)"
    modes = "place => place.data.map(one => one.mode)"
    assert place.evaluate(titles) == ["y [V]", "u [V]"]
    assert place.evaluate(modes)[0] == "lines"
    page.locator(".explorer [data-choose=drive]").select_option(label="d")
    page.locator(".explorer [data-choose=signal]").select_option(label="z")
    assert place.evaluate(titles) == ["z [mV]", "d [V/s]"]
    assert place.evaluate(modes)[0] == "lines+markers"


def test_the_tabulator_reaches_the_contents_and_the_first_choice(opened):
    page = opened("diagnosis")
    reached = []
    for _ in range(10):
        page.keyboard.press("Tab")
        reached.append(page.evaluate("document.activeElement.textContent.trim()"))
    contents = ["Verdict", "Evidence", "Doubts", "Next steps", "Provenance"]
    assert reached[:7] == ["Skip the summary", *contents, "Colours: system"]
    assert page.evaluate("document.activeElement.dataset.choose") == "recording"


def test_both_models_stand_below_each_other_where_the_difference_lies(opened):
    page = opened("diagnosis")
    scrolled_through(page)
    heat = page.locator("figure.drawn", has=page.get_by_role("heading", name="Where the difference lies"))
    strongest = """place => place.data.filter(one => one.z)
        .map(one => Math.max(...one.z.flat().filter(v => v !== null)))"""
    before, after = heat.locator(".plot").evaluate(strongest)
    assert after < before
    assert heat.locator(".plot").bounding_box()["height"] < 800


def test_the_difference_is_the_larger_drawing_and_has_the_noise_behind_it(opened):
    page = opened("diagnosis")
    page.wait_for_function("document.querySelector('.explorer .plot').dataset.drawn")
    place = page.locator(".explorer .plot")
    own, difference = place.evaluate(
        "place => ['yaxis', 'yaxis2'].map(name => place._fullLayout[name].domain)"
    )
    assert difference[0] > own[1]
    assert difference[1] - difference[0] > 2.0 * (own[1] - own[0])
    assert place.evaluate("place => place._fullLayout.shapes.length") == 1
    assert page.locator(".explorer .legend .noise").is_visible()


def test_light_and_dark_follow_the_system_and_the_button(opened):
    ground = "getComputedStyle(document.body).backgroundColor"
    line = "document.querySelector('.explorer .plot')._fullData.at(1).line.color"
    page = opened("diagnosis", scheme="dark")
    page.wait_for_function("document.querySelector('.explorer .plot').dataset.drawn")
    assert page.evaluate(ground) == "rgb(20, 23, 27)"
    dark = page.evaluate(line)
    button = page.locator("#theme")
    button.click()
    assert button.text_content() == "Colours: light"
    assert page.evaluate(ground) == "rgb(255, 255, 255)"
    assert page.evaluate(line) != dark
    button.click()
    assert page.evaluate(ground) == "rgb(20, 23, 27)"


def test_paper_says_what_was_chosen_on_the_screen(opened, files):
    """Which of its panels a figure shows stands in a list that is not printed."""
    name = next(name for name, file in files.items() if 'class="chosen"' in file.read_text("utf-8"))
    page = opened(name, 1280)
    figure = page.locator("figure:has(.chosen)").first
    figure.scroll_into_view_if_needed()
    select = figure.locator("select")
    last = select.locator("option").last.inner_text()
    select.select_option(label=last)
    assert not figure.locator(".chosen").is_visible()
    page.emulate_media(media="print")
    assert figure.locator(".chosen").is_visible()
    assert figure.locator(".chosen").inner_text().endswith(last)
    assert not select.is_visible()


def test_paper_gets_every_figure_as_wide_as_it_is_and_every_table(opened, tmp_path):
    page = opened("diagnosis", scheme="dark")
    page.evaluate("dispatchEvent(new Event('beforeprint'))")
    widths = page.evaluate("[...document.querySelectorAll('.plot')].map(place => place._fullLayout.width)")
    assert len(set(widths)) == 1
    assert widths[0] <= 700
    assert page.evaluate("getComputedStyle(document.body).backgroundColor") == "rgb(255, 255, 255)"
    shut = "document.querySelectorAll('details:not([open])').length"
    assert page.evaluate(shut) == 0
    page.evaluate("dispatchEvent(new Event('afterprint'))")
    assert page.evaluate(shut) > 0
    assert page.evaluate("getComputedStyle(document.body).backgroundColor") == "rgb(20, 23, 27)"
    page.pdf(path=tmp_path / "page.pdf", format="A4")
    assert (tmp_path / "page.pdf").stat().st_size > 50_000
