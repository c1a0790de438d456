from __future__ import annotations

from pathlib import Path

import polars as pl

from tests.dataset.changing import Survey, bssid, surveyed, usual_places
from vislam2tag.common.files.folder import Folder
from vislam2tag.dataset.comparing.change_record import (
    NOTHING_COMPARED,
    RECORD,
    SurveyChanges,
    survey_record,
    write_changes,
)
from vislam2tag.dataset.comparing.changes import CHANGED, VANISHED, survey_changes


def test_files_tell_what_the_tables_hold(tmp_path: Path) -> None:
    places = usual_places()
    del places[8]
    changes = survey_changes(surveyed(Survey("base")), surveyed(Survey("later", places=places)), "wifi")
    record = survey_record("one", "two", [changes])
    write_changes(Folder.at(tmp_path / "changes"), record, [changes])
    assert SurveyChanges.model_validate_json((tmp_path / "changes" / RECORD).read_bytes()) == record
    (technology,) = record.technologies
    assert [(point.bssid, point.change) for point in technology.changed] == [(bssid(8), VANISHED)]
    points = pl.read_csv(tmp_path / "changes" / "access_points.csv")
    cells = pl.read_csv(tmp_path / "changes" / "places.csv")
    assert dict(points["change"].value_counts().iter_rows()) == technology.access_points
    assert dict(cells["change"].value_counts().iter_rows()) == technology.places
    assert set(points["technology"]) == {"wifi"}
    assert points["bssid"][0] == bssid(8)
    changed = cells.filter(pl.col("change") == CHANGED)
    assert cells["change"].head(changed.height).unique().to_list() == [CHANGED]
    assert changed["size_db"].is_sorted(descending=True)
    assert set(cells["because"].drop_nulls()) - {""} == {bssid(8)}


def test_nothing_to_compare_is_a_record_without_tables(tmp_path: Path) -> None:
    record = survey_record("one", "two", [])
    write_changes(Folder.at(tmp_path / "changes"), record, [])
    assert [path.name for path in (tmp_path / "changes").iterdir()] == [RECORD]


def test_surveys_without_a_common_place_are_told() -> None:
    changes = survey_changes(surveyed(Survey("base", rows=(3.0,))), surveyed(Survey("later", rows=(27.0,))), "wifi")
    (finding,) = survey_record("one", "two", [changes]).findings
    assert finding.kind == NOTHING_COMPARED
