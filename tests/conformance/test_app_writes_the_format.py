"""Sessions that the app's own Java code writes, against those of the simulator, file by file and label by label.

The simulator tells what a phone saw (a script); the app's core plays it, writes its files and packs its zip.
"""

from __future__ import annotations

import hashlib
import json
import shutil
from pathlib import Path

import numpy as np
import polars as pl
import pytest
from polars.testing import assert_frame_equal

from tests.conformance.java import replay
from vislam2tag.core.status import has_position
from vislam2tag.core.tracks import Trajectory
from vislam2tag.estimation.settings import MappingSettings
from vislam2tag.estimation.strategy import strategy_named
from vislam2tag.pipeline.labels.process import process
from vislam2tag.sessions.model import Session
from vislam2tag.sessions.registry import open_survey, read_session
from vislam2tag.settings import Settings
from vislam2tag.simulation.scenario import regular_survey
from vislam2tag.simulation.settings import SessionLayout
from vislam2tag.simulation.survey import WritingOptions, simulate
from vislam2tag.site.model import Survey
from vislam2tag.studio.receiving.uploads import file_zip

pytestmark = pytest.mark.slow

SITE_FILES = ("floor_dimensions.csv", "floor_0/marker_dict.csv")
SECONDS = 75.0
PLENTY = 100_000_000
FARTHEST_MEDIAN_M, FARTHEST_M = 0.1, 0.5
"""Labels of the published format are later by the pose lag (a few centimetres of walking), and its log tells less."""


@pytest.fixture(scope="module")
def simulated(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, Path]:
    """One survey in both formats: the phone app's, with scripts, and the published."""
    folder = tmp_path_factory.mktemp("simulated")
    scenario = regular_survey(5, "default", (0,), ("LG", "OnePlus"), 1, SECONDS, pressure=True, ble=True, rtt=True)
    simulate(scenario, folder / "phone", WritingOptions(layout=SessionLayout.PHONE, scripts=True))
    simulate(scenario, folder / "published")
    return folder / "phone", folder / "published"


@pytest.fixture(scope="module")
def written(core: Path, simulated: tuple[Path, Path], tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The same survey with sessions as the app wrote, packed and handed them over."""
    out, survey = tmp_path_factory.mktemp("app"), tmp_path_factory.mktemp("survey")
    for name in SITE_FILES:
        (survey / name).parent.mkdir(exist_ok=True)
        shutil.copy(simulated[0] / name, survey / name)
    for script in sorted(simulated[0].rglob("script.txt")):
        device = script.parents[1].name
        done = replay(core, script, out / device)
        assert done.returncode == 0, done.stderr
        session = Path(done.stdout.strip())
        filed = file_zip(survey, session.with_name(session.name + ".zip"), PLENTY)
        assert filed.path == f"floor_0/{device}/{script.parent.name}"
    return survey


def sessions_of(survey: Path) -> dict[str, Session]:
    return {str(ref.key): read_session(ref) for ref in open_survey(survey).sessions}


def test_the_app_s_tables_hold_what_the_phone_saw(simulated: tuple[Path, Path], written: Path) -> None:
    expected, got = sessions_of(simulated[0]), sessions_of(written)
    assert got.keys() == expected.keys()
    for key, session in got.items():
        wanted = expected[key]
        for name, table in session.tables.items():
            assert_frame_equal(table, wanted.tables[name], check_exact=True)
        for field in ("time_ns", "position_acs", "orientation_acs", "status"):
            np.testing.assert_array_equal(getattr(session.camera, field), getattr(wanted.camera, field))
        for field in ("ids", "landmark", "frame", "position_acs", "orientation_acs", "lost", "seen"):
            np.testing.assert_array_equal(getattr(session.landmarks, field), getattr(wanted.landmarks, field))
        assert session.camera.anchors is not None
        assert wanted.camera.anchors is not None
        for field in ("anchor", "frame", "position_acs", "orientation_acs"):
            np.testing.assert_array_equal(getattr(session.camera.anchors, field), getattr(wanted.camera.anchors, field))
        assert session.camera.state is not None
        assert wanted.camera.state is not None
        np.testing.assert_array_equal(session.camera.state.tracking, wanted.camera.state.tracking)
        assert session.camera.exposure_known
        assert [finding.kind for finding in session.findings] == [finding.kind for finding in wanted.findings]


def test_labels_are_those_of_the_simulator_s_files(simulated: tuple[Path, Path], written: Path, tmp_path: Path) -> None:
    for name, survey in (("simulated", simulated[0]), ("written", written)):
        process(survey, tmp_path / name, Settings())
    for table in ("trajectory", "wifi", "sensors", "ble", "rtt"):
        expected, got = (pl.read_parquet(tmp_path / name / table / "*.parquet") for name in ("simulated", "written"))
        assert_frame_equal(got, expected, check_exact=True)
        assert set(got["status"]) >= {"ok"}


def test_labels_are_near_those_of_the_published_format(simulated: tuple[Path, Path], written: Path) -> None:
    phone, published = open_survey(written), open_survey(simulated[1])
    compared = 0
    for ref, other in zip(phone.sessions, published.sessions, strict=True):
        assert ref.key.device == other.key.device
        mine, theirs = mapped(phone, ref.slug), mapped(published, other.slug)
        both = has_position(mine.status) & has_position(theirs.status)
        compared += int(both.sum())
        apart = np.linalg.norm(mine.position_bcs[both, :2] - theirs.position_bcs[both, :2], axis=1)
        sure = np.maximum(mine.sigma_m[both], theirs.sigma_m[both]) < 0.3
        assert np.median(apart[sure]) < FARTHEST_MEDIAN_M
        assert np.quantile(apart[sure], 0.95) < FARTHEST_M
    assert compared > 1000


def mapped(survey: Survey, slug: str) -> Trajectory:
    ref = next(ref for ref in survey.sessions if ref.slug == slug)
    session = read_session(ref)
    landmarks = survey.site.landmarks.on_floor(ref.key.floor)
    return strategy_named("smoother", MappingSettings()).map(session.camera, session.landmarks, landmarks)


def test_the_app_s_zip_has_its_sums_and_its_record(written: Path) -> None:
    for sums in sorted(written.rglob("SHA256SUMS")):
        lines = sums.read_text(encoding="utf-8").splitlines()
        assert [line[66:] for line in lines] == sorted(path.name for path in sums.parent.iterdir() if path != sums)
        for line in lines:
            assert hashlib.sha256((sums.parent / line[66:]).read_bytes()).hexdigest() == line[:64]
        record = json.loads((sums.parent / "session.json").read_text(encoding="utf-8"))
        assert record["end"]["state"] == "stopped"


HAND_MADE = "\n".join(
    (
        "set\tfloor\t4",
        "set\tdevice\tLG",
        'set\tnote\tsays \\t "hi"',
        "set\tzone\tEurope/Berlin",
        "clock\t84210000000000\t61110000000000\t1640003123417",
        "start\t84210000000000",
        "frame\t84210371200456\t61110333500123\tTRACKING\tNONE\t0.5\t0\t0\t0\t0\t0\t1",
        "anchor\t0\tTRACKING\t0.5\t0\t0\t0\t0\t0\t1",
        'image\ta, "b"\tTRACKING\tFULL_TRACKING\t1\t0\t-1\t0.5\t-0.5\t-0.5\t0.5\t0.2\t0',
        "scan_refused\t84210400000000",
        "scan\t84211100000000\tstale",
        'reading\t84211002345\t02:11:22:33:44:55\tä;,"\\\\ \\n\t-61\t5180\t80\t5210\t0',
        "press\t84212000000000",
        "press\t84213000000000",
        "undo\t84214000000000",
        "floor\t84215000000000\t-1",
    )
)


@pytest.mark.parametrize("ending", ["stop", "kill"])
def test_hard_text_presses_undone_and_kills(core: Path, ending: str, tmp_path: Path) -> None:
    script = tmp_path / "script.txt"
    script.write_text(f"{HAND_MADE}\n{ending}\t84220000000000\n", encoding="utf-8")
    survey = tmp_path / "survey"
    done = replay(core, script, survey / "floor_4" / "LG")
    assert done.returncode == 0, done.stderr
    (session,) = sessions_of(survey).values()
    assert session.key.session == "2021-12-20T132523"
    assert session.landmarks.ids == ('a, "b"',)
    assert session.camera.time_ns.tolist() == [84210333500123]
    assert session.tables["wifi"]["ssid"].to_list() == ['ä;,"\\ \ufffd']
    assert session.tables["wifi"]["time_ns"].to_list() == [84211002345000]
    assert session.presses_ns.tolist() == [84212000000000]
    assert session.recording is not None
    assert session.recording.ended == ("stopped" if ending == "stop" else "killed")
    assert session.recording.scans_refused == 2  # one refused, one that failed
    assert session.recording.note == 'says \t "hi"'
    assert session.camera.told_floors is not None
    assert session.camera.told_floors.time_ns.tolist() == [84215000000000]
    assert session.camera.told_floors.floor.tolist() == [-1]
    kinds = {finding.kind for finding in session.findings}
    assert ("recording_ended" in kinds) == (ending == "kill")
    assert "malformed_lines" not in kinds


def test_a_tracker_that_begins_anew_makes_a_new_part(core: Path, tmp_path: Path) -> None:
    lines = [
        *HAND_MADE.split("\n")[:9],
        "camera\t84211000000000\tunavailable\tphone_call",
        "part\t84212000000000",
        "camera\t84212000000000\tavailable",
        "frame\t84212371200456\t61112333500123\tPAUSED\tBAD_STATE\t0\t0\t0\t0\t0\t0\t1",
        "frame\t84212404200456\t61112366500123\tTRACKING\tNONE\t7\t0\t0\t0\t0\t0\t1",
        "anchor\t1\tTRACKING\t7\t0\t0\t0\t0\t0\t1",
        "stop\t84213000000000",
    ]
    script = tmp_path / "script.txt"
    script.write_text("\n".join(lines) + "\n", encoding="utf-8")
    done = replay(core, script, tmp_path / "survey" / "floor_4" / "LG")
    assert done.returncode == 0, done.stderr
    (session,) = sessions_of(tmp_path / "survey").values()
    assert session.camera.state is not None
    assert session.camera.state.section.tolist() == [0, 1, 1]
    assert session.camera.state.tracking.tolist() == [True, False, True]
    assert session.camera.anchors is not None
    assert session.camera.anchors.anchor.tolist() == [0, 1]
    assert session.recording is not None
    assert session.recording.events["part"] == 1
    found = {finding.kind: finding.message for finding in session.findings}
    assert "bad state (1x)" in found["tracking_lost"]
    assert "tracking_restarted" in found


def test_a_script_that_is_wrong_is_told(core: Path, tmp_path: Path) -> None:
    script = tmp_path / "script.txt"
    script.write_text("set\tfloor\t4\nnonsense\n", encoding="utf-8")
    done = replay(core, script, tmp_path / "out")
    assert done.returncode == 1
    assert "nonsense" in done.stderr or "2" in done.stderr


def test_taps_on_the_app_s_plan_are_the_fixes_of_a_walk_without_camera(core: Path, tmp_path: Path) -> None:
    lines = [
        *HAND_MADE.split("\n")[:6],
        "tap\t84211000000000\t3.5\t-2.25\t0.6",
        "tap\t84212000000000\t9\t9\t0.6",
        "undo\t84212500000000",
        "tap\t84213000000000\t12.5\t4\t0.6",
    ]
    for time_ns in range(84213100000000, 84213500000000, 10_000_000):
        lines += [f"sensor\t{time_ns}\t{name}\t{time_ns}\t3\t0.1\t9.8\t0.1" for name in ("ACC", "GYRO")]
    lines.append("stop\t84220000000000")
    script = tmp_path / "script.txt"
    script.write_text("\n".join(lines) + "\n", encoding="utf-8")
    done = replay(core, script, tmp_path / "survey" / "floor_4" / "LG")
    assert done.returncode == 0, done.stderr
    (session,) = sessions_of(tmp_path / "survey").values()
    assert session.camera.fixes is not None
    assert session.camera.fixes.time_ns.tolist() == [84211000000000, 84213000000000]
    assert session.camera.fixes.position_bcs.tolist() == [[3.5, -2.25], [12.5, 4.0]]
    assert len(session.presses_ns) == 0
