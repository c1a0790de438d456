"""A survey in object storage is the one on disk: its drawings, its phones, and recordings tied across folders."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from tests.estimation.dead_reckoning.ilc20 import make_site
from tests.sessions.companion_walks import OtherClock, write_sensor_logger
from tests.stores import Bucket
from tests.surveys import make_survey
from vislam2tag.common.errors import StoreError
from vislam2tag.common.files.folder import Folder
from vislam2tag.sessions.companion_ties import Tie, recording_sha256, write_tie
from vislam2tag.sessions.prepared import SessionTask, prepared_session
from vislam2tag.sessions.registry import hash_inputs, open_survey, read_session
from vislam2tag.site.corrections.file import Corrections
from vislam2tag.site.stored_survey import survey_at_hand
from vislam2tag.site.walkable import drawn_cells
from vislam2tag.site.walkable.drawn_cells import drawing_mark

OUTLINES = "F1/geojson_map.json"


def tasks_of(root: Path) -> list[SessionTask]:
    survey = open_survey(root)
    return [SessionTask(ref, survey.site, Corrections()) for ref in survey.sessions]


def test_a_worker_without_the_folder_that_was_opened_reads_the_drawing(
    s3: Bucket, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    site = make_site(tmp_path / "site1")
    corners = [(0, 0), (60, 0), (60, 40), (0, 40), (0, 0)]
    outline = {"type": "Polygon", "coordinates": [corners]}
    feature = {"type": "Feature", "properties": {"use": "outline"}, "geometry": outline}
    (site / OUTLINES).write_text(json.dumps({"type": "FeatureCollection", "features": [feature]}), encoding="utf-8")
    here = tasks_of(site)[0]
    with survey_at_hand(s3.upload(site, "drawn")) as root:
        there = tasks_of(root)[0]
    assert there.floor.plan is not None
    assert not there.floor.plan.exists(), "as on another machine"
    assert there.ref.key == here.ref.key, "the trace's beginning names the phone"
    assert drawing_mark(there.floor) == drawing_mark(here.floor)
    areas = []
    for task in (here, there):
        monkeypatch.setattr(drawn_cells, "_areas", {})
        areas.append(prepared_session(task).session.camera.area)
    assert areas[0] is not None
    assert areas[1] is not None
    assert (areas[0].mask == areas[1].mask).all()
    monkeypatch.setattr(drawn_cells, "_areas", {})
    s3.store("drawn").put(OUTLINES, b"another")
    with pytest.raises(
        StoreError, match=r"s3://bucket/drawn/F1/geojson_map.json: was changed during the run; run the same"
    ):
        prepared_session(there)


def test_a_recording_elsewhere_in_the_survey_comes_with_its_session(s3: Bucket, tmp_path: Path) -> None:
    local = make_survey(tmp_path / "survey", devices=("LG",), seconds=10.0)
    (ref,) = open_survey(local).sessions
    walked = read_session(ref)
    clock = OtherClock(5.0, 0.0, int(walked.camera.time_ns[0]))
    recording = local / "floor_0" / "Pixel" / "2023-11-14_22-13-20"
    write_sensor_logger(recording, walked, clock)
    tie = Tie(
        recording="../../Pixel/2023-11-14_22-13-20",
        sha256=recording_sha256(recording),
        by="taps",
        figures="",
        offset_ns=5_000_000_000,
        at_ns=clock.zero_ns,
        rate=0.0,
        sigma_s=0.01,
        lever_arm_m=0.3,
    )
    write_tie(Folder.at(ref.folder), "pixel", tie)
    (here,) = tasks_of(local)
    with survey_at_hand(s3.upload(local, "tied")) as root:
        (there,) = tasks_of(root)
    assert hash_inputs(there.ref) == hash_inputs(here.ref)
    ours, theirs = (prepared_session(task).session.tables["sensors_pixel"] for task in (here, there))
    assert theirs.equals(ours)
