"""A studio as files: what is in them and what is not, and that a browser shows it from any file server.

What was made of a survey to be given away, as the page tells of it.
"""

from __future__ import annotations

import json
import os
from contextlib import closing
from itertools import count
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import polars as pl
import pytest
from playwright.sync_api import Page, expect

from tests.cli.command import vislam2tag
from tests.studio.sharing.file_servers import LATEST_MS, barriers, plain_server, range_server, shown
from tests.studio.test_page import WALKS, every_tab, open_view
from tests.views.browser import running_browser
from vislam2tag.common.errors import OutputError
from vislam2tag.common.files.own_files import OWN_FILES
from vislam2tag.pipeline.labels.process import process
from vislam2tag.settings import Settings
from vislam2tag.simulation.scenario import regular_survey
from vislam2tag.simulation.survey import simulate
from vislam2tag.studio import export
from vislam2tag.studio.export import shared_view
from vislam2tag.studio.radio import Radio
from vislam2tag.studio.workspace import Workspace

REASON = "Ms Miller took it down"
KEY = b"a secret that nobody has"
WHOLE = "This server does not support range requests"


@pytest.fixture(scope="module")
def surveyed(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with a survey of two walks and its labels."""
    folder = tmp_path_factory.mktemp("shared")
    survey = folder / "survey"
    simulate(regular_survey(6, "none", (1,), ("LG",), 2, 60.0), survey)
    text = f'# {REASON}\n[[exclude_landmark]]\nid = "3"\nfloor = 1\nreason = "{REASON}"\n'
    (survey / "corrections.toml").write_text(text, encoding="utf-8")
    process(survey, folder / "survey-labels")
    return folder


@pytest.fixture(scope="module")
def page_folder(surveyed: Path) -> Path:
    """That survey's export, made by the command."""
    (surveyed / "key").write_bytes(KEY)
    survey, out = surveyed / "survey", surveyed / "page"
    done = vislam2tag("studio", survey, "--export", out, "--hash-bssid", surveyed / "key", "--json")
    record = json.loads(done.stdout)
    files = [file for file in (surveyed / "page").rglob("*") if file.is_file() and file.name != OWN_FILES]
    assert (record["surveys"], record["sessions"], record["files"]) == (1, 2, len(files) - 1)
    return surveyed / "page"


def test_no_network_person_or_folder_is_told(surveyed: Path, page_folder: Path) -> None:
    heard = pl.read_parquet(surveyed / "survey-labels" / "wifi" / "*.parquet")
    addresses, names = heard["bssid"].unique().to_list(), heard["ssid"].drop_nulls().unique().to_list()
    assert min(len(addresses), len(names)) > 1
    secrets = [*addresses, str(surveyed), REASON, *(f'"{name}",' for name in names), *(f'"{name}"}}' for name in names)]
    for file in page_folder.rglob("*"):
        if file.is_file() and file.parent.name != "assets":
            content = file.read_bytes()
            assert [secret for secret in secrets if secret.encode() in content] == [], file
    radio = json.loads((page_folder / "data" / "radio.json").read_text())
    points = [point for floor in radio["floors"] for point in floor["access_points"]]
    assert points
    assert all(len(point["bssid"]) == 32 and point["ssid"] is None for point in points)
    (entry,) = json.loads((page_folder / "data" / "corrections.json").read_text())["entries"]
    assert entry["values"] == {"id": "3", "floor": 1}


def test_only_an_earlier_export_is_replaced_and_nothing_is_left_half_written(
    surveyed: Path, page_folder: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    workspace = Workspace(surveyed / "survey", surveyed / "survey-labels", Settings())
    monkeypatch.setattr(export, "write_output", breaks_off)
    monkeypatch.setattr(export, "made_radio", lambda _job: Radio((), {}))
    before = sorted(page_folder.rglob("*"))
    (tmp_path / "notes").mkdir()
    (tmp_path / "notes" / "mine.txt").touch()
    outs = (
        (tmp_path / "notes", "was not made by this command; choose an empty or new folder for --export"),
        (tmp_path / "new", "cannot be written (No space left on device); free space or choose another --export"),
        (page_folder, "cannot be written (No space left on device)"),
    )
    with closing(workspace):
        for out, message in outs:
            with pytest.raises(OutputError) as refused:
                export.export_survey(workspace, out)
            assert message in str(refused.value)
    assert [path.name for path in tmp_path.iterdir()] == ["notes"]
    assert sorted(page_folder.rglob("*")) == before


def breaks_off(*_: object) -> None:
    raise OSError(28, "No space left on device")


@pytest.mark.slow
def test_a_link_leads_to_one_walk_at_one_moment_from_any_file_server(page_folder: Path) -> None:
    (id, *_) = sorted(file.stem for file in (page_folder / "data" / "sessions").iterdir())
    with running_browser() as browser:
        with range_server(page_folder) as url, shown(browser, f"{url}#walk={id}&t=31.5", 1200) as (page, answers):
            expect(page.locator(".time .slider")).to_have_value("31.5", timeout=LATEST_MS)
            expect(page.locator(".values dd").first).not_to_have_text("–", timeout=LATEST_MS)
            expect(page.get_by_text(WHOLE)).to_have_count(0)
            only_shows(page, 3)  # the map's length, its notes, the cells
            parts = [answer for answer in answers if answer.url.endswith("1-wifi.parquet") and answer.status == 206]
            (size,) = {int(answer.headers["content-range"].rpartition("/")[2]) for answer in parts}
            assert 0 < sum(int(answer.headers["content-length"]) for answer in parts) < size / 2
            open_view(page, "Walks")
            page.locator(".time .slider").fill("12")
            page.get_by_role("button", name="Copy link to this moment").click()
            assert page.url == f"{url}#walk={id}&t=12.0&tab=walks&floor=1"
        with plain_server(page_folder) as url, shown(browser, f"{url}#walk={id}&t=31.5", 400) as (page, answers):
            expect(page.locator(".time .slider")).to_have_value("31.5", timeout=LATEST_MS)
            expect(page.get_by_text(WHOLE)).to_be_visible(timeout=LATEST_MS)
            only_shows(page, 2)
            page.goto(f"{url}#walk=nobody")
            expect(page.get_by_text("The survey has no walk nobody.")).to_be_visible()


def says_that_its_server_is_lost(page: Page) -> None:
    expect(page.locator(WALKS)).to_have_count(2, timeout=LATEST_MS)
    page.context.set_offline(True)
    page.locator(f"{WALKS} button").last.click()
    expect(page.get_by_role("alert")).to_contain_text("The server of this page cannot be reached.", timeout=LATEST_MS)
    page.context.set_offline(False)
    expect(page.get_by_role("alert")).to_have_count(0, timeout=LATEST_MS)
    expect(page.get_by_text("Landmarks observed")).to_be_visible(timeout=LATEST_MS)


@pytest.mark.slow
def test_a_page_that_is_opened_as_a_file_says_how_to_serve_it_and_a_lost_server_is_said(page_folder: Path) -> None:
    with running_browser() as browser:
        page = browser.new_page(viewport={"width": 390, "height": 800}, locale="en")
        page.goto((page_folder / "index.html").as_uri())
        title = page.get_by_role("heading", name="This page needs a web server")
        expect(title).to_be_visible()
        assert title.evaluate("title => getComputedStyle(title).fontSize") == "24px", "its style sheet is there"
        assert page.evaluate("document.documentElement.scrollWidth <= innerWidth")
        with plain_server(page_folder) as url:
            page.goto(url)
            expect(page.get_by_role("tab", name="Walks")).to_be_visible(timeout=LATEST_MS)
            expect(title).to_have_count(0)
            says_that_its_server_is_lost(page)


def only_shows(page: Page, reads: int) -> None:
    """Every view is there, fits and bars nobody, and none has a button for what only a running studio does.

    An access point's map is read by so many requests.
    """
    found = []
    gone = page.get_by_role("button").get_by_text("Correct").or_(page.get_by_role("button", name="Undo"))
    for tab in every_tab(page):
        found.append(tab.inner_text().split()[0])
        assert (tab.inner_text(), barriers(page)) == (tab.inner_text(), [])
        expect(gone.or_(page.locator("form"))).to_have_count(0)
    assert found == ["Coverage", "Check", "Walks", "Faults", "Landmarks", "Corrections", "Radio"]
    page.get_by_role("tab", name="Coverage").click()
    expect(page.locator("li[data-floor='1']")).to_contain_text("walked")
    page.get_by_role("tab", name="Radio maps").click()
    read = count(1)
    with page.expect_response(lambda answer: answer.url.endswith("1-wifi.parquet") and next(read) == reads):
        page.locator(".list .row").first.click()
    expect(page.get_by_role("status").get_by_text("100.0 % of the mapped cells are shown.")).to_be_visible(
        timeout=LATEST_MS
    )
    assert page.evaluate("document.documentElement.scrollWidth <= innerWidth")


def test_only_what_is_whole_is_told_and_what_is_older_than_the_labels(tmp_path: Path) -> None:
    workspace: Any = SimpleNamespace(root=tmp_path / "survey", out=tmp_path / "labels")
    page, dataset, result = tmp_path / "survey-page", tmp_path / "survey-dataset", tmp_path / "labels" / "sessions"
    for folder, names in ((page, ("index.html",)), (dataset, ("report.html", "dataset.json")), (result, ("a.json",))):
        folder.mkdir(parents=True)
        for name in names:
            (folder / name).write_text("text")
    assert shared_view(workspace).page is None
    (page / "export.json").write_text("{}")
    os.utime(result / "a.json", ns=(10, 10))
    os.utime(dataset / "report.html", ns=(9, 9))
    os.utime(page / "index.html", ns=(10, 10))
    found = shared_view(workspace)
    assert found.dataset is not None
    assert found.page is not None
    assert (found.dataset.folder, found.dataset.files, found.dataset.size_bytes) == (str(dataset), 2, 8)
    assert (found.dataset.stale, found.page.stale) == (True, False)
