"""A survey of the phone app's format from files to results: what is new in it is told."""

from __future__ import annotations

import json
import re
from pathlib import Path

import pytest

from tests.cli.command import vislam2tag
from vislam2tag.labeling.results import SessionResult
from vislam2tag.pipeline.labels.process import process
from vislam2tag.settings import Settings
from vislam2tag.simulation.scenario import regular_survey
from vislam2tag.simulation.settings import SessionLayout
from vislam2tag.simulation.survey import WritingOptions, simulate


@pytest.fixture(scope="module")
def survey(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """One walk that loses track, was killed, and saw scans refused."""
    out = tmp_path_factory.mktemp("phone")
    scenario = regular_survey(0, "default", (0,), ("OnePlus",), 1, 60.0)
    simulate(scenario, out, WritingOptions(layout=SessionLayout.PHONE))
    (session,) = out.glob("floor_0/OnePlus/*")
    record = json.loads((session / "session.json").read_text(encoding="utf-8"))
    (session / "session.json").write_text(json.dumps(record | {"end": None, "note": "<b>dark</b>"}), encoding="utf-8")
    with (session / "Events.csv").open("a", encoding="utf-8") as events:
        events.write("1,scan_refused,\n" * 3)
    return out


@pytest.fixture(scope="module")
def processed(survey: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    out = tmp_path_factory.mktemp("out") / "labels"
    process(survey, out, Settings())
    return out


def test_the_result_holds_what_the_recorder_says(processed: Path) -> None:
    (file,) = (processed / "sessions").glob("*.json")
    result = SessionResult.model_validate_json(file.read_text(encoding="utf-8"))
    assert result.format == "phone"
    assert result.recording is not None
    assert result.recording.ended == "killed"
    assert result.recording.scans_refused == 3
    assert result.recording.exposure_known
    assert result.pose_lag_s == 0.0
    losses = [event for event in result.events if event.kind == "loss"]
    assert losses
    assert {event.reason for event in losses} == {"EXCESSIVE_MOTION"}
    assert {"recording_ended", "scans_refused", "tracking_lost"} <= {finding.kind for finding in result.findings}


def test_the_report_shows_it(processed: Path) -> None:
    text = (processed / "report.html").read_text(encoding="utf-8")
    assert "excessive motion" in text
    assert "&lt;b&gt;dark&lt;/b&gt;" in text
    assert re.search(r"Scans rejected</td><td[^>]*>3 ", text)
    assert "frames have exposure times" in text


def test_inspect_shows_it(survey: Path) -> None:
    done = vislam2tag("inspect", survey, "--json")
    assert done.returncode == 0, done.stderr
    (session,) = json.loads(done.stdout)["sessions"]
    assert (session["format"], session["ended"], session["scans_refused"]) == ("phone", "killed", 3)
    told = vislam2tag("inspect", survey)
    assert "recording_ended" in told.stdout
    assert "excessive motion" in told.stdout
