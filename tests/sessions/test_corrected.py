"""Corrections applied to a session."""

from __future__ import annotations

import shutil
from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np
import polars as pl
import pytest

from tests.sessions.raw import FRAMES, clean_files, frame_ns, kinds, read_files
from tests.sessions.test_without_poses import session_folder, simulated
from vislam2tag.common.errors import SurveyError
from vislam2tag.core.context import FixLog
from vislam2tag.core.status import Status
from vislam2tag.pipeline.labels.process import process
from vislam2tag.pipeline.run.selection import session_task
from vislam2tag.sessions.corrected import _with_tap, corrected_session, with_taps_corrected
from vislam2tag.sessions.model import Session
from vislam2tag.sessions.prepared import PreparedSession, prepared_session
from vislam2tag.sessions.registry import open_survey
from vislam2tag.settings import Settings
from vislam2tag.site.corrections.edits import corrections_of
from vislam2tag.site.corrections.file import Corrections, SetTap, read_corrections
from vislam2tag.site.model import SessionKey


@pytest.fixture
def session(tmp_path: Path) -> Session:
    return read_files(tmp_path / "LG" / "walk", clean_files())


def corrected_by(**tables: Sequence[Mapping[str, object]]) -> Corrections:
    return Corrections.model_validate({name: tuple(entries) for name, entries in tables.items()})


def test_nothing_to_correct_changes_nothing(session: Session) -> None:
    elsewhere = corrected_by(shift_clock=[{"floor": 9, "table": "wifi", "offset_s": 1.0}])
    corrected, uses = corrected_session(session, elsewhere)
    assert corrected is session
    assert uses == ()


def test_an_excluded_span_makes_its_frames_invalid_and_drops_their_landmark_rows(session: Session) -> None:
    span = {"from_s": 0.5, "to_s": 1.0, "reason": "fell"}
    corrected, uses = corrected_session(session, corrected_by(exclude_span=[span]))
    seconds = (session.camera.time_ns - frame_ns(0)) / 1e9
    inside = (seconds >= 0.5) & (seconds < 1.0)
    assert corrected.camera.status.tolist() == np.where(inside, Status.INVALID, Status.OK).tolist()
    assert not inside[corrected.landmarks.frame].any()
    assert len(corrected.landmarks.frame) == np.count_nonzero(~inside[session.landmarks.frame])
    assert corrected.camera.row.tolist() == session.camera.row.tolist()
    assert corrected.landmarks.row.tolist() == session.landmarks.row[~inside[session.landmarks.frame]].tolist()
    assert uses == (f"frames excluded from 0.5 s to 1 s: {inside.sum()} (fell).",)


def test_a_span_outside_its_session_is_reported(session: Session) -> None:
    spans: list[dict[str, object]] = [{"session": session.key.session, "from_s": 281836.9}, {"from_s": 281836.9}]
    corrected, uses = corrected_session(session, corrected_by(exclude_span=spans))
    (finding,) = (each for each in corrected.findings if each.kind == "unused_correction")
    assert "[[exclude_span]] from 281837 s has no effect" in finding.message
    assert uses == (), "and one for all sessions may be outside of some"


def test_a_landmark_seen_only_in_an_excluded_span_is_not_listed(session: Session) -> None:
    corrected, _ = corrected_session(session, corrected_by(exclude_span=[{"from_s": 0.9}]))
    assert corrected.landmarks.ids == ("10",)


def test_swapped_ids_keep_the_log_sorted(session: Session) -> None:
    swap: dict[str, object] = {"ids": ["10", "7"]}
    corrected, uses = corrected_session(session, corrected_by(swap_landmarks=[swap]))
    assert corrected.landmarks.ids == ("7", "10")
    assert corrected.landmarks.offsets.tolist() == session.landmarks.offsets.tolist()
    assert uses == ("Landmarks 10 and 7 are interchanged.",)
    assert corrected_session(session, corrected_by(swap_landmarks=[swap, swap]))[0].landmarks.ids == ("10", "7")
    assert corrected_session(session, corrected_by(swap_landmarks=[{"ids": ["1", "2"]}])) == (session, ())


def test_an_excluded_landmark_goes_by_its_corrected_id(session: Session) -> None:
    both = corrected_by(swap_landmarks=[{"ids": ["10", "7"]}], exclude_landmark=[{"id": "10"}])
    corrected, uses = corrected_session(session, both)
    assert corrected.landmarks.ids == ("7",)
    assert len(corrected.landmarks.frame) == 50
    assert uses[1] == "Landmark 10 is excluded."
    assert corrected_session(session, corrected_by(exclude_landmark=[{"id": "99"}])) == (session, ())


@pytest.mark.parametrize("table", ["wifi", "sensors"])
def test_a_shifted_table_moves_and_nothing_else_does(session: Session, table: str) -> None:
    shift = {"table": table, "offset_s": -0.25}
    corrected, uses = corrected_session(session, corrected_by(shift_clock=[shift]))
    moved = corrected.tables[table]["time_ns"] - session.tables[table]["time_ns"]
    assert moved.unique().to_list() == [-250_000_000]
    assert corrected.tables[table].drop("time_ns").equals(session.tables[table].drop("time_ns"))
    assert corrected.camera is session.camera
    assert uses == (f"The clock of {table} is shifted by -0.25 s.",)


def test_presses_and_camera_can_be_shifted(session: Session) -> None:
    shifts = [{"table": "presses", "offset_s": 1}, {"table": "camera", "offset_s": 2}]
    corrected, _ = corrected_session(session, corrected_by(shift_clock=shifts))
    assert (corrected.presses_ns - session.presses_ns).tolist() == [10**9] * 3
    assert (corrected.camera.time_ns - session.camera.time_ns).tolist() == [2 * 10**9] * FRAMES


@pytest.mark.parametrize(
    ("table", "file"),
    [("wifi", "wifi.csv"), ("sensors", "sensors.csv"), ("presses", "refMarker.csv"), ("camera", "poses.csv")],
)
def test_shifting_what_is_not_there_is_no_use(tmp_path: Path, table: str, file: str) -> None:
    files = clean_files()
    del files[file]
    session = read_files(tmp_path / "LG" / "walk", files)
    corrected, uses = corrected_session(session, corrected_by(shift_clock=[{"table": table, "offset_s": 1}]))
    assert uses == ()
    assert corrected == session


def test_a_shift_that_mends_a_clock_takes_its_finding_back_and_a_wrong_one_makes_it(tmp_path: Path) -> None:
    files = clean_files()
    files["wifi.csv"] = [line.replace("; 410", "; 420", 1) for line in files["wifi.csv"]]
    session = read_files(tmp_path / "LG" / "walk", files)
    assert kinds(session) == {("clock_mismatch", "wifi.csv"): 12}
    mend = [{"table": "wifi", "offset_s": -1000}]
    assert corrected_session(session, corrected_by(shift_clock=mend))[0].findings == ()
    spoil = [*mend, {"table": "sensors", "offset_s": 1e9}]
    assert kinds(corrected_session(session, corrected_by(shift_clock=spoil))[0]) == {
        ("clock_mismatch", "sensors.csv"): 300
    }


def test_a_shift_stays_within_int64(tmp_path: Path) -> None:
    files = clean_files()
    files["sensors.csv"].append(
        files["sensors.csv"][-1].replace(files["sensors.csv"][-1].split(";")[0], str(2**63 - 1))
    )
    session = read_files(tmp_path / "LG" / "walk", files)
    corrected, _ = corrected_session(session, corrected_by(shift_clock=[{"table": "sensors", "offset_s": 5}]))
    assert corrected.tables["sensors"]["time_ns"].to_numpy().max() == 2**63 - 1


def test_the_clock_of_ble_is_shifted_where_there_is_one(session: Session, tmp_path: Path) -> None:
    shift = corrected_by(shift_clock=[{"table": "ble", "offset_s": 0.25}])
    assert corrected_session(session, shift)[0].tables.keys() == session.tables.keys()
    assert corrected_session(session, shift)[1] == ()
    logged = read_files(tmp_path / "LG" / "ble", clean_files() | {"ble.csv": [f"{frame_ns(3)}; c2:01; desk; -60"]})
    corrected, uses = corrected_session(logged, shift)
    assert corrected.tables["ble"]["time_ns"].to_list() == [frame_ns(3) + 250_000_000]
    assert uses == ("The clock of ble is shifted by +0.25 s.",)


def test_sightings_of_a_span_become_another_landmarks(session: Session) -> None:
    rename = {"id": "10", "to": "10 (second)", "from_s": 0.5}
    corrected, uses = corrected_session(session, corrected_by(rename_landmark=[rename]))
    before, after = session.landmarks, corrected.landmarks
    assert after.ids == ("10", "7", "10 (second)")
    seconds = (session.camera.time_ns[after.frame[after.rows_of(2)]] - frame_ns(0)) / 1e9
    assert seconds.min() >= 0.5
    assert len(after.frame) == len(before.frame)
    assert (np.diff(after.landmark) >= 0).all()
    assert len(uses) == 1
    late = corrected_by(rename_landmark=[{**rename, "from_s": 1e6}])
    assert corrected_session(session, late) == (session, ())


def test_sightings_of_a_span_are_another_floors(session: Session) -> None:
    entry = {"id": "10", "to": 2, "from_s": 0.5}
    corrected, uses = corrected_session(session, corrected_by(set_landmark_floor=[entry]))
    assert corrected.landmarks.ids == ("10", "7", "10 (floor 2)")
    assert "are assigned to 10 (floor 2)" in uses[0]


def test_one_row_of_a_landmark_stays_in_a_frame_where_two_would_be(session: Session) -> None:
    both = corrected_by(rename_landmark=[{"id": "10", "to": "7"}])
    log = corrected_session(session, both)[0].landmarks
    assert log.ids == ("7",)
    assert (np.diff(log.frame) > 0).all()


def test_scans_that_repeat_the_one_before_are_marked(tmp_path: Path) -> None:
    files = clean_files()
    levels = (40, 50, 60, 70)
    files["wifi.csv"] = [
        f"{scan}; {frame_ns(0) // 1000 + scan * 100_000 + i}; WLAN; net; 00:00:00:00:00:1{i}; -{level + (scan == 2)}"
        for scan in range(4)
        for i, level in enumerate(levels)
    ]
    session = read_files(tmp_path / "LG" / "again", files)
    assert session.tables["wifi"].filter("repeated")["scan"].unique().to_list() == [1]
    corrected, uses = corrected_session(session, corrected_by(drop_repeated_scans=[{"device": "LG"}]))
    assert corrected.tables["wifi"].filter("repeated")["scan"].unique().to_list() == [1]
    assert uses == ("1 Wi-Fi scans that repeat the one before are counted once.",)


@pytest.fixture(scope="module")
def walked(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A survey with one walk of four taps."""
    return simulated(tmp_path_factory.mktemp("taps") / "survey")


@pytest.fixture
def survey(walked: Path, tmp_path: Path) -> Path:
    return Path(shutil.copytree(walked, tmp_path / "survey"))


def prepared(survey: Path, entries: str = "") -> PreparedSession:
    (survey / "corrections.toml").write_text(entries, encoding="utf-8")
    opened = open_survey(survey)
    return prepared_session(session_task(opened.sessions[0], opened, read_corrections(survey), Settings()))


def entry(survey: Path, at_s: float, place: tuple[float, float] | None = None) -> str:
    """Of the survey's walk."""
    lines = ["[[set_tap]]", f'session = "{session_folder(survey).name}"', f"at_s = {at_s}"]
    return "\n".join([*lines, *(() if place is None else (f"x = {place[0]}", f"y = {place[1]}"))]) + "\n"


def taps(found: PreparedSession) -> tuple[FixLog, list[float]]:
    """Fixes, and their seconds since the first frame."""
    camera = found.session.camera
    assert camera.fixes is not None
    return camera.fixes, ((camera.fixes.time_ns - camera.time_ns[0]) * 1e-9).tolist()


def test_taps_are_placed_moved_and_taken_out(survey: Path) -> None:
    before, at_s = taps(prepared(survey))
    assert len(at_s) == 4
    between = round((at_s[1] + at_s[2]) / 2, 2)
    text = entry(survey, between, (1, 2)) + entry(survey, round(at_s[0], 1), (3, 4)) + entry(survey, round(at_s[3], 1))
    found = prepared(survey, text)
    after, then_s = taps(found)
    assert then_s == pytest.approx([at_s[0], at_s[1], between, at_s[2]])
    assert after.position_bcs.tolist() == [
        [3, 4],
        before.position_bcs[1].tolist(),
        [1, 2],
        before.position_bcs[2].tolist(),
    ]
    assert after.name == (f"tap at {round(at_s[0], 1):g} s", before.name[1], f"tap at {between:g} s", before.name[2])
    assert found.corrections == (
        f"The walk is placed at (1, 2) at {between:g} s.",
        f"The walk is placed at (3, 4) at {round(at_s[0], 1):g} s.",
        f"The tap at {round(at_s[3], 1):g} s is excluded.",
    )
    nothing = prepared(survey, entry(survey, between))
    assert nothing.corrections == ()
    assert taps(nothing)[1] == at_s


def test_too_few_are_told_of_what_is_left(survey: Path) -> None:
    _, at_s = taps(prepared(survey))
    found = prepared(survey, "".join(entry(survey, round(one, 2)) for one in at_s[1:]))
    assert [finding.kind for finding in found.session.findings] == ["too_few_fixes"]
    (session_folder(survey) / "fixes.csv").write_text("100; 1.0; 2.0\n", encoding="utf-8")
    placed = prepared(survey, entry(survey, 5, (1, 2)) + entry(survey, 25, (3, 4)))
    assert placed.session.findings == ()


def test_a_walk_without_any_tap_is_walked_from_those_that_are_placed(survey: Path, tmp_path: Path) -> None:
    fixes, at_s = taps(prepared(survey))
    good = labels(survey, tmp_path)
    (session_folder(survey) / "fixes.csv").unlink()
    places = zip(at_s, fixes.position_bcs.tolist(), strict=True)
    text = "".join(entry(survey, t, (x, y)) for t, (x, y) in places)
    (survey / "corrections.toml").write_text(text, encoding="utf-8")
    assert labels(survey, tmp_path) == pytest.approx(good, abs=1e-3, nan_ok=True)


def labels(survey: Path, folder: Path) -> np.ndarray:
    """Places (n, 2) of the walk's frames, as ``process`` labels them."""
    assert process(survey, folder / "labels").failed == 0
    (table,) = (folder / "labels" / "trajectory").glob("*.parquet")
    return pl.read_parquet(table).select("x", "y").to_numpy()


def test_half_a_place_is_refused() -> None:
    with pytest.raises(SurveyError, match="give both x and y"):
        corrections_of('[[set_tap]]\nsession = "a"\nat_s = 1.0\nx = 2.0\n')


def test_a_tap_needs_a_session_or_a_floor() -> None:
    with pytest.raises(SurveyError, match="give a session, or a floor"):
        corrections_of("[[set_tap]]\nat_s = 0.0\nx = 2.0\ny = 3.0\n")
    (entry,) = corrections_of("[[set_tap]]\nfloor = 1\nat_s = 0.0\nx = 2.0\ny = 3.0\n").set_tap
    walks = [SessionKey(floor, device, "a") for floor in (0, 1) for device in ("LG", "OnePlus")]
    assert [entry.applies(walk) for walk in walks] == [False, False, True, True]


def test_other_taps_keep_their_sigma() -> None:
    fixes = FixLog(np.array((0, 10**10, 2 * 10**10)), np.zeros((3, 2)), ("a", "b", "c"), np.array((0.5, 0.6, 0.7)))
    moved = _with_tap(fixes, SetTap(session="s", at_s=10.0, x=1.0, y=2.0), 0, [])
    assert moved.sigma_m is not None
    assert moved.sigma_m.tolist() == pytest.approx([0.5, np.nan, 0.7], nan_ok=True)
    left = _with_tap(fixes, SetTap(session="s", at_s=10.0), 0, [])
    assert left.sigma_m is not None
    assert left.sigma_m.tolist() == [0.5, 0.7]


def tap(at_s: float, place: tuple[float, float] | None = None) -> SetTap:
    x, y = (None, None) if place is None else place
    return SetTap(session="walk", at_s=at_s, x=x, y=y)


def test_taps_of_a_session_with_poses_are_known_places(session: Session) -> None:
    assert session.camera.fixes is None
    placed, uses = with_taps_corrected(session, [tap(0.9, (5.0, 6.0)), tap(0.3, (1.0, 2.0))])
    fixes = placed.camera.fixes
    assert fixes is not None
    assert ((fixes.time_ns - session.camera.time_ns[0]) * 1e-9).tolist() == pytest.approx([0.3, 0.9])
    assert fixes.position_bcs.tolist() == [[1, 2], [5, 6]]
    assert fixes.name == ("tap at 0.3 s", "tap at 0.9 s")
    assert uses == ("The walk is placed at (5, 6) at 0.9 s.", "The walk is placed at (1, 2) at 0.3 s.")
    assert placed.camera.position_acs is session.camera.position_acs
    assert not placed.camera.without_poses
    alone, _ = with_taps_corrected(session, [tap(0.5, (1.0, 2.0))])
    assert alone.findings == placed.findings == session.findings, "one tap may be enough"


def test_taps_of_a_session_with_poses_are_moved_and_taken_out(session: Session) -> None:
    entries = [tap(0.9, (5.0, 6.0)), tap(0.3, (1.0, 2.0)), tap(0.85, (7.0, 8.0)), tap(0.35)]
    placed, uses = with_taps_corrected(session, entries)
    fixes = placed.camera.fixes
    assert fixes is not None
    assert fixes.position_bcs.tolist() == [[7, 8]]
    assert uses[3] == "The tap at 0.35 s is excluded."
    nothing, uses = with_taps_corrected(session, [tap(0.5)])
    assert nothing.camera.fixes is not None
    assert len(nothing.camera.fixes.time_ns) == 0
    assert uses == ()


def test_no_entry_leaves_a_session_as_it_is(session: Session) -> None:
    assert with_taps_corrected(session, []) == (session, ())
    assert with_taps_corrected(session, [])[0] is session
