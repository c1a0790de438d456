"""Each trap of the raw layout gives exactly its finding; a clean session gives none."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from tests.locks import lock
from tests.sessions.raw import FRAMES, clean_files, frame_ns, kinds, read_files, to_bytes, write_session
from vislam2tag.common.errors import SessionError
from vislam2tag.common.findings import Severity
from vislam2tag.sessions.model import Session
from vislam2tag.sessions.registry import format_of, hash_inputs, open_survey, read_session
from vislam2tag.site.model import SessionKey, SessionRef

PAPER_NAMES = {
    "poses.csv": "CameraPose.csv",
    "initPoses.csv": "LandmarkPose.csv",
    "wifi.csv": "WiFi.csv",
    "sensors.csv": "Sensors.csv",
    "refMarker.csv": "ControlPoint.csv",
}

Files = dict[str, list[str]]


def accounts_balance(session: Session) -> bool:
    unreadable = {record.name: 0 for record in session.files}
    for finding in session.findings:
        if finding.kind in ("malformed_lines", "partial_last_line"):
            unreadable[finding.file] += finding.count
    return all(record.lines == record.rows + unreadable[record.name] for record in session.files)


def test_a_clean_session_is_read_whole_without_findings(tmp_path: Path) -> None:
    session = read_files(tmp_path / "LG" / "walk", clean_files())
    assert session.findings == ()
    assert len(session.camera.time_ns) == FRAMES
    assert session.camera.position_acs[3].tolist() == pytest.approx([0.12, 1.35, -0.03])
    assert session.landmarks.ids == ("10", "7")
    assert np.bincount(session.landmarks.landmark).tolist() == [50, 30]
    assert session.tables["wifi"]["scan"].to_list() == [5, 5, 5, 6, 6, 6, 7, 7, 7, 8, 8, 8]
    assert session.tables["sensors"]["sensor"].to_list()[:4] == ["ACC", "GYRO", "MAG", "ACC"]
    assert session.presses_ns.tolist() == [frame_ns(5), frame_ns(25), frame_ns(45)]
    assert [(record.name, record.role, record.lines, record.rows) for record in session.files] == [
        ("poses.csv", "poses", 60, 60),
        ("initPoses.csv", "landmarks", 80, 80),
        ("sensors.csv", "sensors", 300, 300),
        ("wifi.csv", "wifi", 12, 12),
        ("refMarker.csv", "presses", 3, 3),
    ]


def test_frames_and_landmark_rows_know_their_lines(tmp_path: Path) -> None:
    files = clean_files()
    files["poses.csv"].insert(2, "no pose")
    files["initPoses.csv"].insert(0, "")
    session = read_files(tmp_path / "LG" / "walk", files)
    assert session.camera.row.tolist() == [1, 2, *range(4, FRAMES + 2)]
    names = [files["initPoses.csv"][row - 1].split(";")[0] for row in session.landmarks.row]
    assert names == [session.landmarks.ids[i] for i in session.landmarks.landmark]
    only = session.landmarks.select([1])
    assert only.row.tolist() == session.landmarks.row[session.landmarks.landmark == 1].tolist()


@pytest.mark.parametrize("renamed", [set(PAPER_NAMES), {"poses.csv", "sensors.csv"}], ids=["paper", "mixed"])
def test_both_sets_of_names_are_found_by_looking(tmp_path: Path, renamed: set[str]) -> None:
    files = {PAPER_NAMES[name] if name in renamed else name: lines for name, lines in clean_files().items()}
    session = read_files(tmp_path / "LG" / "walk", files)
    assert session.findings == ()
    assert {record.name for record in session.files} == set(files)
    assert len(session.camera.time_ns) == FRAMES


@pytest.mark.parametrize("comma_files", [set(clean_files()), {"poses.csv"}, {"sensors.csv", "initPoses.csv"}])
def test_the_decimal_mark_is_decided_file_by_file(tmp_path: Path, comma_files: set[str]) -> None:
    commas = {
        name: [line.replace(".", ",") for line in lines] if name in comma_files else lines
        for name, lines in clean_files().items()
    }
    plain = read_files(tmp_path / "LG" / "plain", clean_files())
    session = read_files(tmp_path / "LG" / "commas", commas)
    assert session.findings == ()
    np.testing.assert_array_equal(session.camera.position_acs, plain.camera.position_acs)
    np.testing.assert_array_equal(session.landmarks.position_acs, plain.landmarks.position_acs)
    assert session.tables["sensors"].equals(plain.tables["sensors"])


def edit(name: str, change: Callable[[list[str]], list[str]]) -> Callable[[Files], None]:
    def apply(files: Files) -> None:
        files[name] = change(files[name])

    return apply


def shifted_times(column: int, offset: int) -> Callable[[list[str]], list[str]]:
    def shift(lines: list[str]) -> list[str]:
        fields = [line.split("; ") for line in lines]
        return ["; ".join((*f[:column], str(int(f[column]) + offset), *f[column + 1 :])) for f in fields]

    return shift


def without(name: str) -> Callable[[Files], None]:
    def apply(files: Files) -> None:
        del files[name]

    return apply


SECOND_NS = 1_000_000_000
TRAPS: dict[str, tuple[Callable[[Files], None], dict[tuple[str, str], int]]] = {
    "sensors on another clock": (
        edit("sensors.csv", shifted_times(0, -3600 * SECOND_NS)),
        {("clock_mismatch", "sensors.csv"): 300},
    ),
    "Wi-Fi on another clock": (edit("wifi.csv", shifted_times(1, 10**12)), {("clock_mismatch", "wifi.csv"): 12}),
    "malformed lines": (
        edit("initPoses.csv", lambda lines: [lines[0], "", "oops", *lines[1:]]),
        {("malformed_lines", "initPoses.csv"): 2},
    ),
    "no Wi-Fi": (without("wifi.csv"), {("missing_file", "wifi.csv"): 1}),
    "no sensors": (without("sensors.csv"), {("missing_file", "sensors.csv"): 1}),
    "no presses": (without("refMarker.csv"), {}),
    "no landmarks": (without("initPoses.csv"), {("missing_file", "initPoses.csv"): 1}),
    "empty Wi-Fi": (edit("wifi.csv", lambda lines: []), {("empty_file", "wifi.csv"): 1}),
}


@pytest.mark.parametrize("trap", TRAPS)
def test_a_trap_gives_exactly_its_finding(tmp_path: Path, trap: str) -> None:
    spring, expected = TRAPS[trap]
    files = clean_files()
    spring(files)
    session = read_files(tmp_path / "LG" / "walk", files)
    assert kinds(session) == expected
    assert accounts_balance(session)


@pytest.mark.parametrize("name", ["poses.csv", "initPoses.csv", "sensors.csv", "wifi.csv"])
def test_a_cut_off_file_loses_its_last_line_only(tmp_path: Path, name: str) -> None:
    files = {file: to_bytes(lines) for file, lines in clean_files().items()}
    files[name] = files[name][: -len(clean_files()[name][-1]) // 2]
    session = read_session(write_session(tmp_path / "LG" / "walk", files))
    found = kinds(session)
    found.pop(("landmark_rows_without_frame", "initPoses.csv"), None)
    assert found == {("partial_last_line", name): 1}
    assert accounts_balance(session)


@pytest.mark.parametrize("poses", [None, [], ["no pose at all"]], ids=["missing", "empty", "unreadable"])
def test_a_session_without_poses_is_returned_with_an_error(tmp_path: Path, poses: list[str] | None) -> None:
    files = clean_files()
    if poses is None:
        del files["poses.csv"]
    else:
        files["poses.csv"] = poses
    session = read_files(tmp_path / "LG" / "walk", files)
    assert len(session.camera.time_ns) == 0
    assert len(session.landmarks.frame) == 0
    assert session.tables["sensors"].height == 300
    assert any(f.severity == Severity.ERROR and f.file == "poses.csv" for f in session.findings)


def test_two_files_for_one_role_are_reported(tmp_path: Path) -> None:
    files = clean_files()
    files["CameraPose.csv"] = files["poses.csv"][:3]
    session = read_files(tmp_path / "LG" / "walk", files)
    assert kinds(session) == {("second_file", "CameraPose.csv"): 1}
    assert len(session.camera.time_ns) == FRAMES


@pytest.mark.parametrize("name", PAPER_NAMES)
def test_a_file_that_cannot_be_opened_is_that_finding_alone(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, name: str
) -> None:
    ref = write_session(tmp_path / "LG" / "walk", clean_files())
    lock(monkeypatch, ref.folder / name)
    session = read_session(ref)
    needed = name in ("poses.csv", "initPoses.csv")
    found = [finding for finding in session.findings if finding.kind != "no_frames"]
    assert [(f.kind, f.file, f.severity) for f in found if f.file == name] == [
        ("unreadable_file", name, Severity.ERROR if needed else Severity.WARNING)
    ]
    assert found[0].message.startswith("cannot be opened (Permission denied): there are no ")
    assert {record.name for record in session.files} == set(PAPER_NAMES) - {name}
    assert accounts_balance(session)


def test_hashes_are_those_of_the_files_read(tmp_path: Path) -> None:
    ref = write_session(tmp_path / "LG" / "walk", clean_files())
    assert hash_inputs(ref) == {record.name: record.sha256 for record in read_session(ref).files}


def test_folders_are_recognised_by_their_files(tmp_path: Path) -> None:
    assert format_of(tmp_path) is None
    (tmp_path / "20220214_Tracking.csv").write_text("time;X;Y\n")
    (tmp_path / "poses.csv").mkdir()
    assert format_of(tmp_path) is None
    (tmp_path / "Sensors.csv").write_text("")
    assert format_of(tmp_path) == "published"


def test_a_folder_that_is_gone_and_an_unknown_format_are_errors_of_ours(tmp_path: Path) -> None:
    key = SessionKey(1, "LG", "walk")
    with pytest.raises(SessionError, match="no such session folder"):
        read_session(SessionRef(key, tmp_path / "gone", "published", "slug"))
    with pytest.raises(SessionError, match="there is no session format 'other'"):
        read_session(SessionRef(key, tmp_path, "other", "slug"))


def test_real_walks_lack_only_what_they_lack(real_walks: Path) -> None:
    survey = open_survey(real_walks)
    assert len(survey.sessions) == 3
    for ref in survey.sessions:
        session = read_session(ref)
        assert kinds(session) == {("missing_file", "wifi.csv"): 1, ("missing_file", "sensors.csv"): 1}
        assert len(session.landmarks.ids) >= 7
        assert accounts_balance(session)


def test_generated_sessions_of_the_published_program_are_read_whole(agreement: Path) -> None:
    survey = open_survey(agreement / "raw")
    assert [ref.slug for ref in survey.sessions][:2] == ["floor_0.LG.2022-01-10T100000", "floor_0.LG.2022-01-11T100000"]
    for ref in survey.sessions:
        session = read_session(ref)
        # Some of these cameras look back all the way: their orientations do not follow the walk.
        assert {finding.kind for finding in session.findings} <= {"tracking_lost", "missing_file", "pose_convention"}
        assert all(record.lines == record.rows for record in session.files)
        assert session.camera.usable.all()
