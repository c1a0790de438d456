"""Simulated sessions in the phone app's format: read back, they are what was simulated."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

from tests.surveys import bytes_of
from vislam2tag.common.errors import UsageError
from vislam2tag.sessions.registry import open_survey, read_session
from vislam2tag.simulation.scenario import Scenario, regular_survey
from vislam2tag.simulation.settings import SessionLayout
from vislam2tag.simulation.survey import WritingOptions, simulate, walk_and_track


def scenario(severity: str = "severe") -> Scenario:
    return regular_survey(6, severity, (0,), ("LG", "OnePlus"), 1, 40.0, pressure=True, ble=True)


@pytest.fixture(scope="module")
def survey(tmp_path_factory: pytest.TempPathFactory) -> Path:
    out = tmp_path_factory.mktemp("phone")
    simulate(scenario(), out, WritingOptions(layout=SessionLayout.PHONE, scripts=True))
    return out


def test_sessions_read_back_are_the_tracker_s(survey: Path) -> None:
    planned = {item.key.device: item for item in scenario().sessions}
    for ref in open_survey(survey).sessions:
        assert ref.format == "phone"
        session = read_session(ref)
        _, tracker = walk_and_track(scenario(), planned[ref.key.device])
        assert tracker.motion is not None
        assert session.camera.time_ns.tolist() == tracker.exposure_ns.tolist()
        assert session.camera.state is not None
        np.testing.assert_array_equal(session.camera.state.tracking, ~tracker.motion.lost)
        assert session.landmarks.ids == tracker.landmarks.ids
        np.testing.assert_allclose(
            session.landmarks.position_acs[~session.landmarks.lost],
            tracker.landmarks.position_acs[~tracker.landmarks.lost],
            atol=1e-4,
        )
        assert session.landmarks.seen is not None
        np.testing.assert_array_equal(session.landmarks.seen, tracker.motion.seen)
        assert {finding.kind for finding in session.findings} <= {"tracking_lost", "stale_wifi_rows"}
        assert "ble" in session.tables
        assert session.camera.pressure is not None


def test_the_same_options_give_the_same_bytes(survey: Path, tmp_path: Path) -> None:
    simulate(scenario(), tmp_path, WritingOptions(layout=SessionLayout.PHONE, scripts=True))
    assert bytes_of(tmp_path) == bytes_of(survey)


def test_folders_have_no_colons_and_hold_the_truth(survey: Path) -> None:
    for ref in open_survey(survey).sessions:
        assert ":" not in ref.folder.name
        assert (ref.folder / "truth.csv").is_file()
        record = json.loads((ref.folder / "session.json").read_text(encoding="utf-8"))
        assert record["session"] == ref.folder.name


def test_traps_and_the_phone_s_format_do_not_go_together(tmp_path: Path) -> None:
    with pytest.raises(UsageError, match="traps"):
        simulate(scenario(), tmp_path, WritingOptions(traps=frozenset({"frame_gap"}), layout=SessionLayout.PHONE))


def test_scripts_are_written_where_asked(survey: Path, tmp_path: Path) -> None:
    assert len(list(survey.rglob("script.txt"))) == 2
    simulate(scenario("none"), tmp_path, WritingOptions(layout=SessionLayout.PHONE))
    assert list(tmp_path.rglob("script.txt")) == []
