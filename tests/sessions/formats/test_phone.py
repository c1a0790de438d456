from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from tests.sessions import raw
from tests.sessions.phone_raw import (
    FRAMES,
    HEADERS,
    IDENTITY,
    NAME,
    START_NS,
    Rows,
    anchor_line,
    camera_line,
    clean_rows,
    frame_ns,
    kinds,
    landmark_line,
    read_rows,
    record,
    wifi_line,
    write_session,
)
from vislam2tag.common.errors import SessionError
from vislam2tag.sessions.registry import format_of, hash_inputs, open_survey, read_session


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    return tmp_path / "LG" / NAME


def test_a_clean_session_has_everything_and_no_finding(folder: Path) -> None:
    session = read_rows(folder, clean_rows())
    assert session.findings == ()
    assert session.camera.usable.all()
    assert session.camera.pose_lag_s == 0.0, "times are those of the exposure"
    assert session.camera.row.tolist() == list(range(2, FRAMES + 2))
    assert session.tables["wifi"]["row"].to_list() == list(range(2, 14))
    assert session.camera.time_ns.tolist() == [frame_ns(frame) for frame in range(FRAMES)]
    assert session.landmarks.ids == ("10", "7")
    assert session.landmarks.seen is not None
    assert session.landmarks.seen.all()
    assert not session.landmarks.lost.any()
    assert session.presses_ns.tolist() == [frame_ns(frame) for frame in (5, 25, 45)]
    assert session.tables["wifi"].height == 12
    assert session.tables["wifi"]["frequency_mhz"].unique().to_list() == [5180.0]
    assert session.tables["sensors"].height == 100
    assert session.tables["sensors"]["v2"].unique().to_list() == [0.0]
    assert session.camera.pressure is not None
    assert len(session.camera.pressure.time_ns) == 50
    assert session.tables["ble"].row(0, named=True)["address"] == "c2:00:00:00:00:01"
    assert session.tables["ble"]["uuid"].to_list() == ["1a7c877a-f875-49ab-b0ef-beb8a92f46ca"]
    assert session.recording is not None
    assert (session.recording.ended, session.recording.note) == ("stopped", "a note")


def changed(rows: Rows, table: str, line: int, new: str) -> Rows:
    """Rows with one line of a table replaced; behind the last one it is added."""
    return rows | {table: [*rows[table][:line], new, *rows[table][line + 1 :]]}


TRAPS: dict[str, tuple[Rows, bytes | None, dict[tuple[str, str], int]]] = {
    "unknown clock": (
        clean_rows() | {"CameraPose.csv": [camera_line(i).replace("boot", "unknown") for i in range(FRAMES)]},
        None,
        {("unknown_exposure", "CameraPose.csv"): FRAMES},
    ),
    "tracked frame without pose": (
        changed(clean_rows(), "CameraPose.csv", 3, camera_line(3, pose=f",1.35,0.0,{IDENTITY}")),
        None,
        {("non_finite_values", "CameraPose.csv"): 1},
    ),
    "other floor": (clean_rows(), record(floor=3), {("other_floor", "session.json"): 1}),
    **{
        f"record {number}": (clean_rows(), content, {("unreadable_record", "session.json"): 1})
        for number, content in enumerate(
            (b"{", b"[]", record(format="other"), record(floor=None), record(version="one"))
        )
    },
}


@pytest.mark.parametrize("trap", TRAPS)
def test_a_trap_gives_exactly_its_finding(folder: Path, trap: str) -> None:
    rows, content, expected = TRAPS[trap]
    session = read_rows(folder, rows, content)
    assert kinds(session) == expected
    assert session.camera.exposure_known == (trap != "unknown clock")
    assert np.flatnonzero(~session.camera.usable).tolist() == ([3] if trap == "tracked frame without pose" else [])

    assert session.key.floor == 1


def test_ranges_are_read_where_the_phone_measured_them(folder: Path) -> None:
    rows = clean_rows()
    earlier = {name: lines for name, lines in rows.items() if name != "Rtt.csv"}  # of an app before them
    assert "rtt" not in read_rows(folder.with_name("2021-12-20T140000"), earlier).tables
    rows["Rtt.csv"] += [
        f"{frame_ns(5)},aa:bb:00:00:00:01,1,4.31,0.52,-55,8,7",
        f"{frame_ns(6)},aa:bb:00:00:00:02,0,-0.12,,-61,8,1",
        f"{frame_ns(6)},aa:bb:00:00:00:02,0,,,-61,8,1",
    ]
    session = read_rows(folder, rows)
    table = session.tables["rtt"]
    assert table["bssid"].to_list() == ["aa:bb:00:00:00:01"] * 2 + ["aa:bb:00:00:00:02"]
    assert table["responder"].to_list() == [True, True, False]
    assert table["range_m"].to_list() == pytest.approx([4.31, 4.31, -0.12])
    assert table["range_sigma_m"].to_list() == pytest.approx([0.52, 0.52, None])
    assert table["repeated"].to_list() == [False, True, False]
    assert [finding.kind for finding in session.findings] == ["malformed_lines"]  # one without a range
    empty = read_rows(folder.with_name("2021-12-20T150000"), rows | {"Rtt.csv": []})
    assert "rtt" not in empty.tables
    assert empty.findings == ()


def test_lines_are_rows_and_findings(folder: Path) -> None:
    rows = clean_rows()
    for name in rows:
        rows[name].insert(1, "nonsense")
    session = read_rows(folder, rows)
    accounts = {record.name: record for record in session.files}
    assert accounts.keys() == {*HEADERS, "session.json"}
    for name in HEADERS:
        assert accounts[name].lines == len(rows[name])
        assert accounts[name].rows == len(rows[name]) - 1
        assert kinds(session)["malformed_lines", name] == 1
    finding = next(finding for finding in session.findings if finding.file == "WiFi.csv")
    assert finding.lines == (3,)  # the header is line 1


def test_frames_that_are_not_tracked_are_losses_with_their_reason_even_if_poses_look_fine(folder: Path) -> None:
    rows = clean_rows()
    for frame in range(20, 30):
        rows["CameraPose.csv"][frame] = camera_line(frame, "PAUSED", "INSUFFICIENT_LIGHT")
    session = read_rows(folder, rows)
    state = session.camera.state
    assert state is not None
    assert np.flatnonzero(~state.tracking).tolist() == list(range(20, 30))
    assert session.camera.usable.all()
    assert (session.camera.position_acs[20:30] == session.camera.position_acs[19]).all()
    lost = session.landmarks.lost
    assert set(session.landmarks.frame[lost].tolist()) == set(range(20, 30))
    assert session.landmarks.seen is not None
    assert not (session.landmarks.seen & lost).any()
    assert session.camera.anchors is not None
    assert not np.isin(session.camera.anchors.frame, np.arange(20, 30)).any()
    (finding,) = session.findings
    assert (finding.kind, finding.file, finding.count) == ("tracking_lost", "CameraPose.csv", 10)
    assert "insufficient light (1x)" in finding.message


@pytest.mark.parametrize("frames", [range(5), range(FRAMES)])
def test_frames_without_any_pose_are_lost_and_held(folder: Path, frames: range) -> None:
    rows = clean_rows()
    for frame in frames:
        rows["CameraPose.csv"][frame] = camera_line(frame, "PAUSED", "NONE", ",,,,,,")
    session = read_rows(folder, rows)
    assert session.camera.usable.all()
    assert np.isfinite(session.camera.position_acs).all()
    assert {finding.kind for finding in session.findings} == {"tracking_lost"}


def test_frames_are_held_within_their_part(folder: Path) -> None:
    rows = clean_rows()
    for frame in range(30, FRAMES):
        line = camera_line(frame) if frame >= 33 else camera_line(frame, "PAUSED", "BAD_STATE")
        rows["CameraPose.csv"][frame] = line.replace(",boot,0,", ",boot,1,")
    session = read_rows(folder, rows)
    assert (session.camera.position_acs[30:33] == session.camera.position_acs[33]).all()
    assert session.camera.state is not None
    assert session.camera.state.section.tolist() == [0] * 30 + [1] * 30
    assert kinds(session) == {("tracking_lost", "CameraPose.csv"): 3, ("tracking_restarted", "CameraPose.csv"): 1}


def test_the_last_known_pose_is_no_sighting(folder: Path) -> None:
    rows = clean_rows()
    rows["LandmarkPose.csv"] = [
        landmark_line("10", frame, "FULL_TRACKING" if frame < 40 else "LAST_KNOWN_POSE") for frame in range(30, 50)
    ]
    session = read_rows(folder, rows)
    assert session.landmarks.seen is not None
    assert session.landmarks.frame[session.landmarks.seen].tolist() == list(range(30, 40))
    assert not session.landmarks.lost.any()


def test_a_landmark_that_is_not_tracked_is_lost_alone(folder: Path) -> None:
    rows = clean_rows()
    rows["LandmarkPose.csv"] = [
        landmark_line("10", 30),
        landmark_line("7", 30, "NOT_TRACKING", "STOPPED"),
        f"{frame_ns(31)},7,STOPPED,NOT_TRACKING,,,,,,,,,",
    ]
    session = read_rows(folder, rows)
    assert session.landmarks.lost.tolist() == [False, True]
    assert session.findings == ()
    assert session.camera.state is not None
    assert session.camera.state.tracking.all()


def test_anchors_are_sorted_and_only_tracked_ones_count(folder: Path) -> None:
    rows = clean_rows()
    rows["AnchorPose.csv"] = [
        anchor_line(n, frame, state)
        for frame, n, state in [
            (2, 1, "TRACKING"),
            (2, 0, "TRACKING"),
            (3, 1, "PAUSED"),
            (4, 0, "STOPPED"),
            (4, 1, "TRACKING"),
            (4, 1, "TRACKING"),
        ]
    ]
    anchors = read_rows(folder, rows).camera.anchors
    assert anchors is not None
    assert anchors.anchor.tolist() == [0, 1, 1]
    assert anchors.frame.tolist() == [2, 2, 4]
    assert anchors.position_acs[:, 0].tolist() == [0.0, 5.0, 5.0]


@pytest.mark.parametrize("lines", [[], [anchor_line(0, FRAMES + 5)]])
def test_no_anchors_are_none(folder: Path, lines: list[str]) -> None:
    assert read_rows(folder, clean_rows() | {"AnchorPose.csv": lines}).camera.anchors is None


def test_presses_that_were_taken_back_do_not_count(folder: Path) -> None:
    rows = clean_rows()
    rows["ControlPoint.csv"].append(f"{frame_ns(50)},1,undo")
    assert read_rows(folder, rows).presses_ns.tolist() == [frame_ns(5), frame_ns(45)]


def test_text_of_networks_may_hold_anything(folder: Path) -> None:
    rows = clean_rows()
    rows["WiFi.csv"] = [wifi_line(0, 0, '"a, ""b"""'), wifi_line(0, 1, ""), wifi_line(0, 2, " ;'\u00e4\ufffd")]
    session = read_rows(folder, rows)
    assert session.tables["wifi"]["ssid"].to_list() == ['a, "b"', "", " ;'\u00e4\ufffd"]
    assert session.findings == ()


def test_refused_scans_and_dropped_rows_are_told(folder: Path) -> None:
    rows = clean_rows()
    rows["Events.csv"] += [f"{START_NS},scan_refused,"] * 3 + [f"{START_NS},scan_failed,"]
    rows["Events.csv"] += [f'{START_NS},rows_dropped,"Sensors.csv, 12"', f"{START_NS},something_new,"]
    session = read_rows(folder, rows)
    assert session.recording is not None
    assert session.recording.scans_refused == 4
    assert session.recording.events["something_new"] == 1
    assert kinds(session) == {("scans_refused", "Events.csv"): 4, ("rows_dropped", "Events.csv"): 1}


def test_scans_that_stopped_with_the_screen_off_are_told(folder: Path) -> None:
    rows = clean_rows()
    events = ("screen_off,", "scans_stopped,wifi", "scans_resumed,wifi 312", "scans_stopped,ble")
    rows["Events.csv"] += [f"{START_NS},{event}" for event in events]
    (finding,) = read_rows(folder, rows).findings
    assert (finding.kind, finding.file, finding.count) == ("scans_stopped", "Events.csv", 2)
    assert "no Bluetooth and Wi-Fi" in finding.message


@pytest.mark.parametrize(
    ("end", "ended"), [(None, "killed"), ({"state": "disk_full", "detail": "12 MB left"}, "disk_full")]
)
def test_how_a_recording_ended_is_told(folder: Path, end: object, ended: str) -> None:
    session = read_rows(folder, clean_rows(), record(end=end))
    assert session.recording is not None
    assert session.recording.ended == ended
    (finding,) = session.findings
    assert (finding.kind, finding.severity.value) == ("recording_ended", "info")
    assert ended in finding.message


def test_a_session_without_record_is_read(folder: Path) -> None:
    session = read_rows(folder, clean_rows(), b"")
    assert kinds(session) == {("missing_file", "session.json"): 1}
    assert session.recording is not None
    assert session.recording.ended == ""
    assert session.camera.usable.all()


def test_an_unknown_version_ends_the_session(folder: Path) -> None:
    with pytest.raises(SessionError, match="update"):
        read_rows(folder, clean_rows(), record(version=2))


def test_a_record_alone_is_a_session_that_cannot_be_mapped(folder: Path) -> None:
    session = read_rows(folder, {})
    found = {(finding.kind, finding.file): finding.severity.value for finding in session.findings}
    assert found["missing_file", "CameraPose.csv"] == "error"
    assert found["missing_file", "LandmarkPose.csv"] == "warning"
    assert found["missing_file", "WiFi.csv"] == "warning"
    assert found["no_frames", "CameraPose.csv"] == "error"
    assert "ble" not in session.tables


def test_tables_with_a_header_only_are_empty_and_no_problem(folder: Path) -> None:
    session = read_rows(folder, clean_rows() | {"Sensors.csv": [], "WiFi.csv": [], "Ble.csv": [], "Events.csv": []})
    assert session.findings == ()
    assert session.tables["sensors"].is_empty()


def test_a_last_line_that_is_cut_is_left_out(folder: Path) -> None:
    ref = write_session(folder, clean_rows())
    for name, cut in (("Sensors.csv", 4), ("CameraPose.csv", 20)):
        data = (folder / name).read_bytes()
        (folder / name).write_bytes(data[:-cut])
    session = read_session(ref)
    assert kinds(session) == {
        ("partial_last_line", "Sensors.csv"): 1,
        ("partial_last_line", "CameraPose.csv"): 1,
        ("landmark_rows_without_frame", "LandmarkPose.csv"): 2,
    }


@pytest.mark.parametrize(("name", "severity"), [("CameraPose.csv", "error"), ("Sensors.csv", "warning")])
def test_a_header_without_a_column_is_told(folder: Path, name: str, severity: str) -> None:
    ref = write_session(folder, clean_rows())
    data = (folder / name).read_bytes()
    (folder / name).write_bytes(data.replace(b"time_ns,", b"when,", 1))
    session = read_session(ref)
    found = {(finding.kind, finding.file): finding for finding in session.findings}
    assert found["malformed_header", name].severity.value == severity
    assert "time_ns" in found["malformed_header", name].message
    account = next(file for file in session.files if file.name == name)
    assert (account.rows, account.lines) == (0, len(clean_rows()[name]))


def test_columns_may_come_in_another_order_and_be_more(folder: Path) -> None:
    ref = write_session(folder, clean_rows())
    expected = read_session(ref)
    path = folder / "ControlPoint.csv"
    lines = [line.split(",") for line in path.read_text(encoding="utf-8").splitlines()]
    path.write_text("".join(f"new,{c},{b},{a}\n" for a, b, c in lines), encoding="utf-8")
    session = read_session(ref)
    assert session.presses_ns.tolist() == expected.presses_ns.tolist()
    assert session.findings == ()


def test_recognised_by_its_record_or_its_header_and_not_where_there_is_none(tmp_path: Path) -> None:
    write_session(tmp_path / "with", {})
    assert format_of(tmp_path / "with") == "phone"
    write_session(tmp_path / "header", {"WiFi.csv": []}, b"")
    assert format_of(tmp_path / "header") == "phone"
    (tmp_path / "header" / "WiFi.csv").write_text("\ufefftime_ns;scan;bssid\n", encoding="utf-8")
    assert format_of(tmp_path / "header") == "phone", "so that its finding names the spreadsheet"
    paper = {"poses.csv": "CameraPose.csv", "initPoses.csv": "LandmarkPose.csv", "sensors.csv": "Sensors.csv"}
    raw.write_session(tmp_path / "paper", {paper.get(name, name): lines for name, lines in raw.clean_files().items()})
    assert format_of(tmp_path / "paper") == "published"


def test_surveys_mix_formats_and_hashes_cover_all_files(tmp_path: Path) -> None:
    write_session(tmp_path / "floor_1" / "LG" / NAME, clean_rows())
    raw.write_session(tmp_path / "floor_1" / "LG" / "2022-01-14T16:35:30", raw.clean_files())
    survey = open_survey(tmp_path)
    assert [ref.format for ref in survey.sessions] == ["phone", "published"]
    assert hash_inputs(survey.sessions[0]).keys() == {*HEADERS, "session.json"}


def test_windows_line_ends_are_read(folder: Path) -> None:
    ref = write_session(folder, clean_rows())
    expected = read_session(ref)
    for name in HEADERS:
        path = folder / name
        path.write_bytes(path.read_bytes().replace(b"\n", b"\r\n"))
    session = read_session(ref)
    assert session.findings == ()
    assert session.tables["wifi"].equals(expected.tables["wifi"])
    assert session.camera.state is not None
    assert replace(session.camera.state, failures=("NONE",)).tracking.all()
