from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import polars as pl
import pytest

from tests.datasets.changing import POINTS, Survey, bssid, surveyed, usual_places
from vislam2tag.common.files.folder import Folder
from vislam2tag.datasets import changes as kind
from vislam2tag.datasets.schema import ACCESS_POINTS
from vislam2tag.pipeline.datasets.join import write_changes

LAST = (55.0, 25.0)
"""Where access point 23 hangs."""


def compared(base: Survey, later: Survey) -> kind.Changes:
    return kind.survey_changes(surveyed(base), surveyed(later), "wifi")


def kinds(changes: kind.Changes) -> dict[str, str]:
    """The access points that did not stay as they are."""
    table = changes.access_points.filter(pl.col("change") != kind.UNCHANGED)
    return dict(table.select("bssid", "change").iter_rows())


def without(*gone: int) -> dict[int, tuple[float, float]]:
    return {index: place for index, place in usual_places().items() if index not in gone}


def test_in_a_building_that_stays_as_it_is_next_to_nothing_is_flagged() -> None:
    points = places = changed_points = changed_places = 0
    for seed in range(8):
        found = compared(Survey("base", seed), Survey("later", seed + 100, offsets_db={"Pixel": 5.0}))
        points += found.access_points.height
        places += found.places.height
        changed_points += len(kinds(found))
        changed_places += found.places.filter(pl.col("change") == kind.CHANGED).height
    assert points == 8 * POINTS
    assert changed_points < 0.05 * points
    assert changed_places < 0.05 * places


def test_what_was_removed_added_and_moved_is_named() -> None:
    before, after = without(4), without(11) | {20: (56.0, 4.0)}
    found = compared(Survey("base", places=before), Survey("later", places=after))
    assert kinds(found) == {bssid(4): kind.APPEARED, bssid(11): kind.VANISHED, bssid(20): kind.MOVED}


def test_where_it_was_and_where_it_is() -> None:
    found = compared(Survey("base"), Survey("later", places=without(20) | {20: (56.0, 4.0)})).access_points
    row = found.row(by_predicate=pl.col("bssid") == bssid(20), named=True)
    assert (row["base_x"], row["base_y"]) == pytest.approx(usual_places()[20], abs=6.0)
    assert (row["later_x"], row["later_y"]) == pytest.approx((56.0, 4.0), abs=6.0)


@pytest.mark.parametrize(("power_dbm", "change"), [(-28.0, kind.LOUDER), (-48.0, kind.FAINTER)])
def test_another_power_is_no_move(power_dbm: float, change: str) -> None:
    assert kinds(compared(Survey("base"), Survey("later", power_dbm={8: power_dbm}))) == {bssid(8): change}


def test_an_access_point_is_not_gone_where_nobody_walked() -> None:
    near = dict(zip(range(6), usual_places().values(), strict=False))
    base = Survey("base", places={**near, 23: LAST}, sensitivity_dbm=-60.0)
    found = compared(base, Survey("later", places=near, rows=(3.0,), sensitivity_dbm=-60.0))
    assert kinds(found) == {bssid(23): kind.NOT_COMPARED}


def test_a_hotspot_that_moves_is_not_compared() -> None:
    base = surveyed(Survey("base"))
    points = base.access_points.with_columns(mobile=pl.col("bssid") == bssid(20))
    moving = replace(base, tables={**base.tables, ACCESS_POINTS: points})
    found = kind.survey_changes(moving, surveyed(Survey("later", places=without(20) | {20: (56.0, 4.0)})), "wifi")
    assert kinds(found) == {bssid(20): kind.MOBILE}


def test_a_new_wall_is_seen_by_its_places_not_blamed_on_access_points() -> None:
    found = compared(Survey("base"), Survey("later", wall_db=12.0))
    changed = found.places.filter(pl.col("change") == kind.CHANGED)
    behind = found.places.filter(pl.col("x") > 40.0)
    assert changed.height > 0.5 * behind.height
    assert changed.filter(pl.col("x") < 36.0).is_empty()


def test_places_near_what_was_removed_changed_and_name_it() -> None:
    found = compared(Survey("base"), Survey("later", places=without(8, 9))).places
    changed = found.filter(pl.col("change") == kind.CHANGED)
    assert not changed.is_empty()
    assert set(changed["because"].explode()) <= {bssid(8), bssid(9)}
    x, y = usual_places()[8]
    near = found.filter(((pl.col("x") - x) ** 2 + (pl.col("y") - y) ** 2).sqrt() < 4.0)
    assert set(near["change"]) == {kind.CHANGED}


def test_places_are_told_by_who_walked_them() -> None:
    base = Survey("base", rows=(3.0, 9.0, 15.0))
    found = compared(base, Survey("later", places=without(8), rows=(3.0, 15.0, 27.0))).places
    assert set(found.filter(pl.col("y") > 24)["change"]) == {kind.NEW}
    missing = found.filter(pl.col("later") == 0)
    assert set(missing["change"]) == {kind.OUTDATED, kind.NOT_WALKED}
    outdated = missing.filter(pl.col("change") == kind.OUTDATED)
    assert set(outdated["because"].explode()) == {bssid(8)}


def test_another_building_does_not_pass_for_noise() -> None:
    others = {100 + index: place for index, place in usual_places().items()}
    told = list(kinds(compared(Survey("base"), Survey("later", places=others))).values())
    assert (told.count(kind.VANISHED), told.count(kind.APPEARED)) == (POINTS, POINTS)


def test_surveys_without_a_common_place_compare_nothing() -> None:
    found = compared(Survey("base", rows=(3.0,)), Survey("later", rows=(27.0,)))
    assert set(kinds(found).values()) == {kind.NOT_COMPARED}
    assert set(found.places["change"]) == {kind.NEW, kind.NOT_WALKED}
    (finding,) = kind.survey_record("one", "two", [found]).findings
    assert finding.kind == kind.NOTHING_COMPARED


def test_a_technology_that_nobody_logged() -> None:
    base = surveyed(Survey("base"))
    found = kind.survey_changes(base, base, "ble")
    assert found.access_points.is_empty()
    assert found.places.is_empty()


def test_one_scan_a_place_is_enough_to_compare() -> None:
    few = surveyed(Survey("base", rows=(3.0,)))
    found = kind.survey_changes(few, surveyed(Survey("later", rows=(3.0,))), "wifi", cell_m=1.0)
    assert found.places["base"].max() == 1
    assert not found.places.filter(pl.col("change") == kind.CHANGED).height


def test_files_tell_what_the_tables_hold(tmp_path: Path) -> None:
    places = usual_places()
    del places[8]
    changes = kind.survey_changes(surveyed(Survey("base")), surveyed(Survey("later", places=places)), "wifi")
    record = kind.survey_record("one", "two", [changes])
    write_changes(Folder.at(tmp_path / "changes"), record, [changes])
    assert kind.SurveyChanges.model_validate_json((tmp_path / "changes" / kind.RECORD).read_bytes()) == record
    (technology,) = record.technologies
    assert [(point.bssid, point.change) for point in technology.changed] == [(bssid(8), kind.VANISHED)]
    points = pl.read_csv(tmp_path / "changes" / "access_points.csv")
    cells = pl.read_csv(tmp_path / "changes" / "places.csv")
    assert dict(points["change"].value_counts().iter_rows()) == technology.access_points
    assert dict(cells["change"].value_counts().iter_rows()) == technology.places
    assert set(points["technology"]) == {"wifi"}
    assert points["bssid"][0] == bssid(8)
    changed = cells.filter(pl.col("change") == kind.CHANGED)
    assert cells["change"].head(changed.height).unique().to_list() == [kind.CHANGED]
    assert changed["size_db"].is_sorted(descending=True)
    assert set(cells["because"].drop_nulls()) - {""} == {bssid(8)}
