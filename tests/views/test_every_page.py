"""Every page that the program writes, in a real browser: readable at any width, light and dark, for everybody."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from importlib import resources
from pathlib import Path
from typing import Literal

import pytest
from axe_playwright_python.sync_playwright import Axe
from playwright.sync_api import Browser

from tests.datasets.factory import small_dataset
from tests.positioning.test_benchmark_tables import record
from tests.preparation.planning.floors import write_ring_site
from tests.site.plans import drawn_floor
from tests.undrawn import undrawn
from tests.views.browser import note_problems, running_browser
from tests.views.factory import make_results, make_survey
from tests.views.test_conflict_page import write_page_of_conflicts
from tests.views.test_dataset_page import make_dataset
from tests.views.test_fleet_pages import write_fleet_page, write_session_page
from tests.views.test_quality_pages import evaluation, write_page_of_a_check
from tests.views.test_run_dashboard import page_of, table_of, totals
from vislam2tag.datasets.folder import write_dataset
from vislam2tag.datasets.settings import RadioMapSettings
from vislam2tag.datasets.statistics import dataset_statistics
from vislam2tag.datasets.statistics_record import Table3
from vislam2tag.pipeline.datasets.radio_maps import write_radio_maps
from vislam2tag.pipeline.site.plan import PlanRequest, write_plans
from vislam2tag.pipeline.site.show import draw_site, summarise_site
from vislam2tag.positioning.benchmark import Benchmark, benchmark_rows
from vislam2tag.positioning.benchmark_tables import best_models
from vislam2tag.preparation.planning.settings import PlanSettings
from vislam2tag.quality.evaluation.paper import PaperTable
from vislam2tag.settings import Settings
from vislam2tag.site.discover import read_site
from vislam2tag.site.plans.source import PlanSource
from vislam2tag.views.click_pages import write_align_page, write_click_page, write_measure_page
from vislam2tag.views.dataset_page import dataset_page
from vislam2tag.views.quality_pages import write_evaluation_page
from vislam2tag.views.result_pages import (
    CollectionPart,
    FigurePart,
    PositioningPart,
    TablePart,
    write_benchmark_page,
    write_paper_page,
)
from vislam2tag.views.run_report import write_report
from vislam2tag.views.run_summary import summarise

pytestmark = pytest.mark.slow
PICTURE = b'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 700 200"><path d="M0 0L700 200"/></svg>'


def report(folder: Path) -> Path:
    survey = make_survey(folder / "survey")
    results = make_results(survey)
    write_report(folder / "page.html", survey, Settings(), results, summarise(results, "smoother", "1"))
    return folder / "page.html"


def dashboard(folder: Path) -> Path:
    survey = make_survey(folder / "campus")
    table_of(folder / "labels", survey.sessions[0].slug, [0.1, 0.2])
    page_of(folder, survey, totals(survey, whole=False), "landmarks 2 and 9 are interchanged", sessions=1)
    return folder / "index.html"


def an_evaluation(folder: Path) -> Path:
    write_evaluation_page(folder / "page.html", "survey", evaluation())
    return folder / "page.html"


def dataset(folder: Path) -> Path:
    made = make_dataset(folder)
    (folder / "page.html").write_text(dataset_page(made, dataset_statistics(made)), encoding="utf-8")
    return folder / "page.html"


def radio_maps(folder: Path) -> Path:
    write_dataset(small_dataset(), folder / "set")
    with undrawn():
        write_radio_maps(folder / "set", folder / "maps", RadioMapSettings(cell_m=2.0, most=3))
    return folder / "maps" / "index.html"


def benchmark(folder: Path) -> Path:
    runs = [record("weighted-knn", "LG", None, 2.0), record("local-kriging", "LG", None, 2.5)]
    rows = benchmark_rows(runs)
    found = Benchmark(
        version="1",
        dataset="set",
        data_sha256={},
        seeds=1,
        rows=rows,
        runs=runs,
        failed=[],
        best=best_models(rows),
    )
    parts = [FigurePart("map.device.weighted-knn", "On the plan", "About it.", PICTURE, 7.0)]
    write_benchmark_page(folder / "page.html", found, parts, None)
    return folder / "page.html"


def paper(folder: Path) -> Path:
    statistics = dataset_statistics(small_dataset())
    collection = CollectionPart("table_3", Table3.of(statistics.by_device, statistics.walks))
    figures = [FigurePart("figure_1", "Walks", "About them.", PICTURE, 7.0)]
    tables = [TablePart("table_1", PaperTable(title="Table I", rows=()), {}, missing="no presses")]
    positioning = PositioningPart("table_4", None, missing="no splits")
    write_paper_page(folder / "page.html", "data", {}, tables, collection, positioning, figures, ["a: failed"])
    return folder / "page.html"


def plan(folder: Path) -> Path:
    with undrawn():
        write_plans(write_ring_site(folder / "site"), folder / "plan", PlanSettings(further=0), PlanRequest())
    return folder / "plan" / "index.html"


def site(folder: Path) -> Path:
    draw_site(summarise_site(write_ring_site(folder / "site")), "site", folder / "page.html")
    return folder / "page.html"


def click(folder: Path) -> Path:
    write_ring_site(folder / "site")
    (folder / "site" / "floor_1" / "floor_info.csv").write_text("width,height\n30,16\n")
    floor = read_site(folder / "site")[0].floors[0]
    write_click_page(folder / "page.html", floor, {"8": (3.0, 1.5)}, ("7", "8"))
    return folder / "page.html"


def measure(folder: Path) -> Path:
    write_measure_page(
        folder / "page.html", drawn_floor.png(folder), PlanSource(file="plan.png"), "vislam2tag site init site"
    )
    return folder / "page.html"


def align(folder: Path) -> Path:
    write_ring_site(folder / "site", (0, 1))
    floor, onto = read_site(folder / "site")[0].floors
    write_align_page(folder / "page.html", floor, onto, "vislam2tag site align site --floor 0 --onto 1")
    return folder / "page.html"


def receive(folder: Path) -> Path:
    text = (resources.files("vislam2tag.studio.receiving") / "page.html").read_text("utf-8")
    (folder / "page.html").write_text(text, encoding="utf-8")
    return folder / "page.html"


PAGES = (
    report,
    dashboard,
    write_page_of_a_check,
    write_page_of_conflicts,
    an_evaluation,
    dataset,
    radio_maps,
    benchmark,
    paper,
    plan,
    site,
    click,
    measure,
    align,
    receive,
    write_fleet_page,
    write_session_page,
)


SCREENS: tuple[tuple[Literal["light", "dark"], tuple[int, ...]], ...] = (("light", (400,)), ("dark", (1400, 800)))
"""Widths of one window: it is narrowed while the page is open."""


@pytest.fixture(scope="module")
def browser() -> Iterator[Browser]:
    with running_browser() as running:
        yield running


@pytest.mark.parametrize("write", PAGES, ids=lambda write: write.__name__)
def test_everybody_can_read_it(browser: Browser, tmp_path: Path, write: Callable[[Path], Path]) -> None:
    file = write(tmp_path)
    assert file.stat().st_size < 5e6
    for scheme, widths in SCREENS:
        problems: list[str] = []
        page = browser.new_page(viewport={"width": widths[0], "height": 900}, color_scheme=scheme)
        note_problems(page, problems)
        page.goto(file.as_uri())
        page.wait_for_function(
            "[...document.querySelectorAll('div.plot')].every((one) => one.hidden || one.children.length)"
        )
        for width in widths:
            page.set_viewport_size({"width": width, "height": 900})
            page.wait_for_function("document.documentElement.scrollWidth <= innerWidth")
            found = Axe().run(page).response["violations"]
            serious = [
                (one["id"], one["nodes"][0]["html"]) for one in found if one["impact"] in ("serious", "critical")
            ]
            assert (scheme, width, serious) == (scheme, width, [])
        page.close()
        assert problems == []
