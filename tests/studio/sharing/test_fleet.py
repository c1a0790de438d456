"""A fleet's list as files: what is in it, and that a browser finds a survey, a walk and a moment in it."""

from __future__ import annotations

import json
import re
from pathlib import Path
from typing import NamedTuple

import polars as pl
import pytest
from playwright.sync_api import Page, expect

from tests.cli.command import the_error, vislam2tag
from tests.stores import Bucket
from tests.studio.sharing.file_servers import LATEST_MS, barriers, plain_server, range_server, shown
from tests.studio.sharing.generated_fleet import generated_rows
from tests.studio.test_page import WALKS
from tests.surveys import make_survey
from tests.views.browser import running_browser
from vislam2tag.common.errors import UsageError
from vislam2tag.pipeline.fleet.catalogue import Fleet
from vislam2tag.settings import Settings
from vislam2tag.studio.fleet import FIRST_ROWS, export_fleet

SURVEYS = 1000
PAINTED_BYTES = 250_000
"""As many as come in 2 s over 1 Mbit/s."""
RADIO = "02:00:5e:10:00:01"
FAULT = "/home/miller/fleet/surveys/x/floor_1/plan.png: cannot be read"


class Shared(NamedTuple):
    """A fleet of which one survey is there, and its page."""

    survey: Path
    address: str
    page: Path


@pytest.fixture(scope="module")
def shared(s3: Bucket, tmp_path_factory: pytest.TempPathFactory) -> Shared:
    folder = tmp_path_factory.mktemp("fleet")
    (folder / "settings.toml").write_text('strategy = "local-corrected"\n')
    survey, address = make_survey(folder / "ward-7", devices=("LG",), seconds=25.0), s3.store("shared-fleet").address
    assert vislam2tag("fleet", "add", address, survey).returncode == 0
    done = vislam2tag("fleet", "process", address, "--jobs", "1", "--config", folder / "settings.toml")
    assert done.returncode == 0, done.stderr
    rows = generated_rows(SURVEYS - 1)
    rows[-1] |= {"error": FAULT, "devices": [RADIO], "site": f"Site of {RADIO}"}
    Fleet(Path(address)).change(rows)
    done = vislam2tag("studio", address, "--export", folder / "page", "--config", folder / "settings.toml", "--json")
    assert done.returncode == 0, done.stderr
    record = json.loads(done.stdout)
    assert (record["surveys"], record["sessions"]) == (SURVEYS, 1)
    return Shared(survey, address, folder / "page")


def test_the_list_holds_all_surveys_and_tells_neither_places_nor_addresses(shared: Shared) -> None:
    first = json.loads((shared.page / "fleet" / "first.json").read_text())
    table = pl.read_parquet(shared.page / "fleet" / "catalogue.parquet")
    assert table.head(FIRST_ROWS).to_dicts() == first["rows"]
    assert (len(table), first["name"], first["totals"]["surveys"]) == (SURVEYS, "shared-fleet", SURVEYS)
    assert table.filter("page")["survey"].to_list() == ["ward-7"]
    assert table.filter(pl.col("site").str.contains("Site of"))["devices"].to_list() == ["(address)"]
    (labels,) = {file.name for file in (shared.page / "surveys").iterdir()}
    assert labels == "ward-7"
    heard = {each for file in shared.survey.rglob("wifi*.csv") for each in addresses_in(file)}
    assert heard
    secrets = [*heard, RADIO, FAULT, "/home/miller", str(shared.survey), shared.address, "s3:/"]
    for file in shared.page.rglob("*"):
        if file.is_file() and file.parent.name != "assets":
            content = file.read_bytes()
            assert [secret for secret in secrets if secret.encode() in content] == [], file


def addresses_in(file: Path) -> set[str]:
    words = file.read_text(encoding="utf-8").replace(";", ",").split(",")
    return {word for word in words if word.count(":") == 5}


def test_only_surveys_that_are_named_are_told_and_a_wrong_name_is_one_message(tmp_path: Path) -> None:
    fleet = Fleet(tmp_path / "fleet")
    fleet.change(generated_rows(3))
    record = export_fleet(fleet.root, tmp_path / "page", lambda _: Settings(), ["survey-000001"])
    first = json.loads((tmp_path / "page" / "fleet" / "first.json").read_text())
    assert [row["survey"] for row in first["rows"]] == ["survey-000001"]
    assert (record.surveys, record.sessions, first["totals"]["surveys"]) == (1, 0, 1)
    with pytest.raises(UsageError, match=r"survey-9: .* has no such survey"):
        export_fleet(fleet.root, tmp_path / "page", lambda _: Settings(), ["survey-9"])


@pytest.mark.parametrize(
    ("options", "message"),
    [
        (("fleet",), "is a fleet; pass --export DIR without --labels and --compare, or open one of its surveys"),
        (("fleet", "--export", "page", "--labels", "x"), "is a fleet; pass --export DIR without"),
        (("survey", "--export", "page", "--survey", "x"), "--survey: survey is not a fleet; remove the option"),
    ],
)
def test_what_does_not_fit_a_fleet_is_refused(
    options: tuple[str, ...], message: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    Fleet(Path("fleet")).change(generated_rows(1))
    Path("survey").mkdir()
    assert message in the_error(vislam2tag("studio", *options))


@pytest.mark.slow
def test_a_browser_finds_a_survey_among_a_thousand_and_a_moment_of_a_walk(shared: Shared) -> None:
    with running_browser() as browser:
        with range_server(shared.page) as url, shown(browser, url, 1400) as (page, answers):
            expect(page.locator(".list .row")).to_have_count(FIRST_ROWS, timeout=LATEST_MS)
            asked = {answer.url.removeprefix(url): len(answer.body()) for answer in answers}
            assert asked.keys() & {"fleet/catalogue.parquet", "assets/App.js"} == set()
            assert sum(asked.values()) < PAINTED_BYTES
            found_and_opened(page, "Search", "All surveys", "1,000 of 1,000 surveys", "1 of 1,000 surveys")
            address = page.url
        with plain_server(shared.page) as url, shown(browser, url, 400, "de") as (page, _):
            counts = "1.000 von 1.000 Vermessungen", "1 von 1.000 Vermessungen"
            found_and_opened(page, "Suche", "Alle Vermessungen", *counts)
            lost = browser.new_page(locale="de")
            lost.goto(f"{url}?survey=nobody")
            expect(lost.get_by_text("404")).to_be_visible(timeout=LATEST_MS)
            lost.get_by_role("link", name="Alle Vermessungen").click()
            expect(lost.locator(".list .row")).to_have_count(FIRST_ROWS, timeout=LATEST_MS)
        assert address.partition("?")[2].startswith("survey=ward-7#walk=floor_0.LG.")


def found_and_opened(page: Page, search: str, back: str, all: str, one: str) -> None:
    """Search and filter the list, open a survey and go to a moment of its walk by a link."""
    expect(page.get_by_text(all)).to_be_visible(timeout=LATEST_MS)
    looks_right(page)
    page.locator("select").select_option("unreadable")
    page.locator("input[type=date]").first.fill("2026-06-01")
    expect(page.locator(".list .row").first).to_contain_text("survey-000879", timeout=LATEST_MS)  # until the 2nd
    expect(page.locator(".list .chip.warning")).to_have_count(page.locator(".list .row").count())
    page.locator("input[type=date]").first.fill("")
    page.locator("select").select_option("")
    page.get_by_label(search).fill("WARD")
    expect(page.get_by_text(one)).to_be_visible(timeout=LATEST_MS)
    looks_right(page)
    page.get_by_role("link").click()
    page.locator(f"{WALKS} button").first.click(timeout=LATEST_MS)
    page.locator(".time .slider").fill("7.5")
    page.get_by_role("button", name="Link").click()
    expect(page).to_have_url(re.compile(r"survey=ward-7#walk=.*&t=7.5&tab=walks&floor=0$"))
    address = page.url
    page.get_by_role("link", name=back).click()
    expect(page.get_by_text(all)).to_be_visible(timeout=LATEST_MS)
    page.goto(address)
    expect(page.locator(".time .slider")).to_have_value("7.5", timeout=LATEST_MS)
    looks_right(page)


def looks_right(page: Page) -> None:
    assert barriers(page) == []
    assert page.evaluate("document.documentElement.scrollWidth <= innerWidth")
