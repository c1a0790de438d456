"""The page in a real browser; skipped where none is installed."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from playwright.sync_api import Browser, Page

from tests.views.browser import note_problems, running_browser
from tests.views.factory import make_result, make_results, make_survey
from vislam2tag.core.status import EventKind
from vislam2tag.labeling.results import Drawing, Polyline, SessionResult, Stretch
from vislam2tag.settings import Settings
from vislam2tag.views.run_report import write_report
from vislam2tag.views.run_summary import summarise

pytestmark = pytest.mark.slow
EVIL = "</script><img src=x onerror=alert(1)>"


@pytest.fixture(scope="module")
def browser() -> Iterator[Browser]:
    with running_browser() as running:
        yield running


@pytest.fixture(scope="module")
def report(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Two floors with plans, eight sessions; one has a folder name that tries to break out of the page."""
    folder = tmp_path_factory.mktemp("report")
    survey = make_survey(folder / "survey")
    results = make_results(survey, points=200)
    results[1] = results[1].model_copy(update={"session": EVIL})
    write_report(folder / "report.html", survey, Settings(), results, summarise(results, "local-corrected", "0.1.0"))
    return folder / "report.html"


@pytest.fixture
def problems() -> list[str]:
    """What the browser complains about, and what it asks the network for."""
    return []


@contextmanager
def opened(browser: Browser, report: Path, problems: list[str]) -> Iterator[Page]:
    page = browser.new_page(viewport={"width": 1280, "height": 900})
    note_problems(page, problems)
    page.goto(report.as_uri())
    page.wait_for_selector("#times .barlayer")
    yield page
    page.close()


@pytest.fixture
def page(browser: Browser, report: Path, problems: list[str]) -> Iterator[Page]:
    with opened(browser, report, problems) as page:
        yield page


@pytest.fixture(scope="module")
def kept(browser: Browser, report: Path) -> Iterator[tuple[Page, list[str]]]:
    """One page for all tests that leave it as it was, and what the browser complains about."""
    problems: list[str] = []
    with opened(browser, report, problems) as page:
        yield page, problems


@pytest.fixture
def kept_page(kept: tuple[Page, list[str]]) -> Page:
    return kept[0]


def points_drawn(page: Page, floor: int) -> dict[str, int]:
    """Number of points of each session layer as the map holds them."""
    script = """(floor) => Object.fromEntries(document.getElementById(`map-${floor}`).data
        .filter((trace) => trace.meta).map((trace) => [trace.meta, trace.x.filter((x) => x !== null).length]))"""
    counts: dict[str, int] = page.evaluate(script, floor)
    return counts


def test_opens_offline_without_complaint(kept: tuple[Page, list[str]]) -> None:
    page, problems = kept
    page.wait_for_load_state("networkidle")
    assert problems == []


def test_every_floor_has_its_map_as_svg(kept_page: Page) -> None:
    for floor in (1, 2):
        assert kept_page.locator(f"#map-{floor} image").count() == 1
        assert kept_page.locator(f"#map-{floor} .scatterlayer .trace").count() >= 10
        assert kept_page.locator(f"#map-{floor} .scatterlayer path.js-line").count() >= 5
        assert kept_page.locator(f"#map-{floor} .legend .traces").count() >= 10
    assert kept_page.locator("canvas").count() == 0
    assert kept_page.locator("#times .barlayer path").count() >= 8


def test_metres_are_equally_long_on_both_axes(kept_page: Page) -> None:
    script = """() => { const layout = document.getElementById('map-1')._fullLayout;
        return [layout.xaxis, layout.yaxis].map((axis) => axis._length / (axis.range[1] - axis.range[0])); }"""
    x, y = kept_page.evaluate(script)
    assert x == pytest.approx(y, rel=1e-3)


def test_chooser_shows_one_session_and_all_again(kept_page: Page) -> None:
    everything, elsewhere = points_drawn(kept_page, 1), points_drawn(kept_page, 2)
    options = kept_page.locator("#floor-1 select option").all_inner_texts()
    assert options[0] == "all sessions (4)"
    assert len(options) == 5
    paths = kept_page.locator("#map-1 .scatterlayer path.js-line")
    drawn = [paths.nth(index).get_attribute("d") for index in range(paths.count())]
    kept_page.select_option("#floor-1 select", index=1)
    one = points_drawn(kept_page, 1)
    assert 0 < one["ok"] < everything["ok"]
    assert one["raw"] * 4 == everything["raw"]
    assert [paths.nth(index).get_attribute("d") for index in range(paths.count())] != drawn
    assert points_drawn(kept_page, 2) == elsewhere
    kept_page.select_option("#floor-1 select", "all")
    assert points_drawn(kept_page, 1) == everything


def test_legend_hides_a_layer_and_the_chooser_keeps_it_hidden(page: Page) -> None:
    page.locator("#map-1 .legend .traces", has_text="raw path").locator(".legendtoggle").click()
    hidden = "() => document.getElementById('map-1').data.find((trace) => trace.meta === 'raw').visible"
    page.wait_for_function(f"({hidden})() === 'legendonly'")
    page.select_option("#floor-1 select", index=2)
    assert page.evaluate(hidden) == "legendonly"


def test_table_sorts_by_a_column_and_keeps_details_with_their_row(page: Page) -> None:
    durations = "#floor-1 .sessions > tbody > tr:first-child > td:nth-child(2)"
    page.locator("#floor-1 th button", has_text="Duration").click()
    falling = [float(cell.get_attribute("data-sort") or 0) for cell in page.locator(durations).all()]
    assert falling == sorted(falling, reverse=True)
    page.locator("#floor-1 th button", has_text="Duration").click()
    rising = [float(cell.get_attribute("data-sort") or 0) for cell in page.locator(durations).all()]
    assert rising == falling[::-1]
    assert page.locator("#floor-1 .sessions > tbody > tr.more details").count() == 4


def test_failed_session_stands_out_and_its_link_leads_there(kept_page: Page) -> None:
    failed = kept_page.locator("tbody.failed")
    assert failed.count() == 1
    kept_page.locator("a[data-session]").click()
    kept_page.wait_for_function("document.querySelector('tbody.failed').getBoundingClientRect().top < innerHeight")
    assert failed.locator("p.error-box").is_visible()


def mapped_at(result: SessionResult, walk: Polyline, runaway: Polyline) -> SessionResult:
    """Make a session that is mapped along ``walk``, and lost on a stretch that runs away."""
    lost = [Stretch(status="break", points=runaway)]
    drawing = Drawing(mapped=[Stretch(status="ok", points=walk)], discarded=lost, raw=runaway, wifi=[])
    return result.model_copy(update={"drawing": drawing, "visits": []})


def axis_ranges(page: Page) -> list[list[float]]:
    script = "() => { const l = document.getElementById('map-1').layout; return [l.xaxis.range, l.yaxis.range]; }"
    ranges: list[list[float]] = page.evaluate(script)
    return ranges


@pytest.mark.parametrize(
    ("walk", "plan_known", "x_range", "y_range"),
    [
        ([(20.0, 20.0), (30.0, 30.0)], True, (-1, 85), (-1, 43)),
        ([(-38.0, 5.0), (-18.0, 5.0), (-18.0, 50.0)], True, (-39, 85), (-1, 51)),
        ([(20.0, 20.0), (600.0, 20.0), (20.0, -400.0)], True, (-1, 85), (-1, 43)),
        ([(-2.0, 20.0), (30.0, 30.0)], False, (-3, 77), (8, 33)),
    ],
)
def test_view_holds_what_is_mapped_beside_the_plan(
    browser: Browser,
    tmp_path: Path,
    walk: Polyline,
    plan_known: bool,
    x_range: tuple[float, float],
    y_range: tuple[float, float],
) -> None:
    survey = make_survey(tmp_path, floors=1, sessions=1)
    if not plan_known:
        floor = replace(survey.site.floors[0], width_m=None, height_m=None)
        survey = replace(survey, site=replace(survey.site, floors=(floor,)))
    results = [mapped_at(make_result(survey.sessions[0]), walk, [(20.0, 20.0), (900.0, -700.0)])]
    write_report(tmp_path / "report.html", survey, Settings(), results, summarise(results, "local", "0.1.0"))
    page = browser.new_page(viewport={"width": 1280, "height": 900})
    page.goto((tmp_path / "report.html").as_uri())
    page.wait_for_selector("#times .barlayer")
    first = axis_ranges(page)
    page.evaluate("Plotly.relayout('map-1', {'xaxis.range': [1, 2]})")
    assert axis_ranges(page) != first
    page.mouse.dblclick(*centre(page))
    page.wait_for_function("(low) => document.getElementById('map-1').layout.xaxis.range[0] === low", arg=first[0][0])
    again = axis_ranges(page)
    page.close()
    assert again == pytest.approx(np.array(first))
    for (low, high), expected in zip(first, (x_range, y_range), strict=True):
        assert low <= expected[0] + 1e-6
        assert high >= expected[1] - 1e-6
    wide = [high - low for low, high in first]
    assert min(w / (high - low) for w, (low, high) in zip(wide, (x_range, y_range), strict=True)) == pytest.approx(1)


def centre(page: Page) -> tuple[float, float]:
    map_area = page.locator("#map-1 .nsewdrag")
    map_area.scroll_into_view_if_needed()
    box = map_area.bounding_box()
    assert box is not None
    return box["x"] + box["width"] / 2, box["y"] + box["height"] / 2


def test_page_is_no_wider_than_the_window(kept_page: Page) -> None:
    for width in (390, 1280):
        kept_page.set_viewport_size({"width": width, "height": 900})
        script = "document.querySelector('#map-1 .main-svg').getBoundingClientRect().width <= innerWidth"
        kept_page.wait_for_function(script)
        assert kept_page.evaluate("document.documentElement.scrollWidth") <= width


def trace_of(page: Page, floor: int, layer: str) -> dict[str, list[float | None]]:
    script = """([floor, layer]) => { const trace = document.getElementById(`map-${floor}`).data
        .find((trace) => trace.meta === layer); return {x: trace.x, y: trace.y, hovertext: trace.hovertext}; }"""
    found: dict[str, list[float | None]] = page.evaluate(script, [floor, layer])
    return found


def test_band_reaches_as_far_to_both_sides_as_the_95_percent_region(browser: Browser, tmp_path: Path) -> None:
    survey = make_survey(tmp_path, floors=1, sessions=1, plan=False)
    walk = Stretch(status="ok", points=[(10.0, 5.0), (20.0, 5.0), (30.0, 5.0)], sigma_m=[0.1, 0.2, 0.4])
    vague = Stretch(status="uncertain", points=[(30.0, 5.0), (30.0, 15.0)], sigma_m=[0.6, 1.0])
    silent = Stretch(status="ok", points=[(40.0, 5.0), (50.0, 5.0)])
    result = make_result(survey.sessions[0]).model_copy(update={"drawing": Drawing(mapped=[walk, vague, silent])})
    write_report(tmp_path / "report.html", survey, Settings(), [result], summarise([result], "smoother", "1"))
    page = browser.new_page()
    page.goto((tmp_path / "report.html").as_uri())
    page.wait_for_selector("#times .barlayer")
    band, labelled = trace_of(page, 1, "band"), trace_of(page, 1, "ok")
    page.close()
    left, right, close = [5.245, 5.49, 5.98], [4.02, 4.51, 4.755], [5.245]
    assert band["y"][:7] == pytest.approx([*left, *right, *close])
    assert band["x"][:7] == pytest.approx([10, 20, 30, 30, 20, 10, 10])
    assert band["x"][7] is None
    assert band["x"][8:] == pytest.approx([30 - 1.47, 30 - 2.45, 30 + 2.45, 30 + 1.47, 30 - 1.47])
    assert band["y"][8:] == pytest.approx([5, 15, 15, 5, 5])
    assert str(labelled["hovertext"][1]).endswith(", sigma 0.20 m")
    assert "sigma" not in str(labelled["hovertext"][-1])


def test_events_and_contradictions_are_on_the_map(kept_page: Page) -> None:
    drawn = points_drawn(kept_page, 1)
    assert [drawn[f"event_{kind.value}"] for kind in EventKind] == [4] * (len(EventKind) - 1) + [0]
    assert kept_page.locator("#map-1 .textpoint text", has_text="3: 2.00 m off").count() == 1
    assert kept_page.locator("#map-2 .textpoint text", has_text="11: 2.00 m off").count() == 1
    kept_page.select_option("#floor-1 select", index=1)
    assert points_drawn(kept_page, 1)["event_break"] == 1
    kept_page.locator("#floor-1 tbody details summary").first.click()
    assert kept_page.locator("#floor-1 table.events").first.locator("tr").count() == 1 + len(EventKind)
    kept_page.locator("#floor-1 tbody details summary").first.click()
    kept_page.select_option("#floor-1 select", "all")


def test_reliability_and_coverage_are_drawn(kept_page: Page) -> None:
    charts = kept_page.locator("#uncertainty .chart")
    assert charts.count() == 2
    for index in range(2):
        assert charts.nth(index).locator(".scatterlayer path.js-line").count() == 2
    assert "limit 0.5 m" in charts.nth(1).inner_text()


def test_a_walk_is_drawn_on_each_floor_it_led_to(browser: Browser, tmp_path: Path, problems: list[str]) -> None:
    survey = make_survey(tmp_path / "survey")
    own, other = (Drawing(mapped=[Stretch(status="ok", points=[(x, 1.0), (x, 5.0)])]) for x in (10.0, 20.0))
    walk = make_result(survey.sessions[0]).model_copy(
        update={"drawing": own, "elsewhere": {2: other}, "visits": [], "events": []}
    )
    write_report(tmp_path / "report.html", survey, Settings(), [walk], summarise([walk], "smoother", "0.1.0"))
    page = browser.new_page(viewport={"width": 1280, "height": 900})
    page.on("pageerror", lambda error: problems.append(f"page error: {error}"))
    page.goto((tmp_path / "report.html").as_uri())
    page.wait_for_selector("#times .barlayer")
    script = "(floor) => document.getElementById(`map-${floor}`).data.find((trace) => trace.meta === 'ok').x"
    drawn = [page.evaluate(script, floor) for floor in (1, 2)]
    page.close()
    assert drawn == [[10.0, 10.0], [20.0, 20.0]]
    assert problems == []
