"""GetSensorData logs as sessions: marks in degrees become fixes, and the walk is mapped through them."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import polars as pl
import pytest

from tests.estimation.dead_reckoning.walks import START_NS, corners, walked
from tests.sessions.getsensordata import HEAD, MAC, ORIGIN, posi
from vislam2tag.common.errors import SessionError
from vislam2tag.core.faults import EventKind
from vislam2tag.estimation.settings import WITHOUT_TRACKER, MappingSettings
from vislam2tag.estimation.strategy import strategy_named
from vislam2tag.pipeline.labels.process import process
from vislam2tag.sessions.prepared import SessionTask, prepared_session
from vislam2tag.sessions.registry import open_survey, read_session
from vislam2tag.survey.corrections.file import Corrections

BOOT_S = 400.0
WAY = np.add(corners((20, 0), (0, 15), (-10, 0)), (5.0, 5.0))
SITE = f"""[georeference]
latitude_deg = {ORIGIN.latitude_deg}
longitude_deg = {ORIGIN.longitude_deg}
bearing_deg = 0.0

[[floors]]
number = 1
"""


def log_text() -> str:
    """A log of a walk along :data:`WAY`, a mark at each corner, and one on another floor."""
    log, fixes = walked(WAY, noise=0.05)
    at_s = (log.rate_ns - START_NS) * 1e-9
    rows = [
        (at, f"{kind};{at:.3f};{at + BOOT_S:.3f};{angles}{x:.6f};{y:.6f};{z:.6f};3")
        for kind, angles, values in (
            ("ACCE", "", log.force),
            ("GYRO", "", log.rate),
            ("AHRS", "0;0;0;", log.orientation * np.where(log.orientation[:, 3:] < 0, -1, 1)),
        )
        for at, (x, y, z) in zip(at_s.tolist(), values[:, :3].tolist(), strict=True)
    ]
    marks = zip(((fixes.time_ns - START_NS) * 1e-9).tolist(), fixes.position_bcs.tolist(), strict=True)
    rows += [(at, posi(at, x, y)) for at, (x, y) in marks]
    rows += [(9.0, posi(9.0, 300.0, 300.0, floor=2)), (7.0, f"WIFI;7.000;{BOOT_S + 5:.3f};net;{MAC};2412;-60")]
    return HEAD + "\n".join(row for _, row in sorted(rows)) + "\n"


@pytest.fixture
def survey(tmp_path: Path) -> Path:
    """A survey of one such log, with a georeference."""
    folder = tmp_path / "survey" / "floor_1" / "SM-A310F" / "walk"
    folder.mkdir(parents=True)
    (folder / "T01.txt").write_text(log_text(), encoding="utf-8")
    (tmp_path / "survey" / "site.toml").write_text(SITE, encoding="utf-8")
    return tmp_path / "survey"


def test_a_log_is_mapped_through_the_marks_of_its_floor(survey: Path, tmp_path: Path) -> None:
    (ref,) = open_survey(survey).sessions
    assert ref.format == "getsensordata"
    summary = process(survey, tmp_path / "out")
    assert (summary.failed, set(summary.frames)) == (0, {"ok"})
    table = pl.read_parquet(next((tmp_path / "out" / "trajectory").glob("*.parquet")))
    corner_ns = round((BOOT_S + 20 / 1.2) * 1e9)
    at = int(np.argmin(np.abs(table["time_ns"].to_numpy() - corner_ns)))
    assert np.linalg.norm(table.select("x", "y").to_numpy()[at] - WAY[1]) < 0.6
    wifi = pl.read_parquet(next((tmp_path / "out" / "wifi").glob("*.parquet")))
    assert wifi.select("x", "y").row(0) == pytest.approx((5 + 5 * 1.2, 5), abs=0.8)


def test_marks_need_a_georeference_and_their_own_floor(survey: Path) -> None:
    (survey / "site.toml").write_text("[[floors]]\nnumber = 1\n", encoding="utf-8")
    opened = open_survey(survey)
    prepared = prepared_session(SessionTask(opened.sessions[0], opened.site, Corrections()))
    assert [finding.kind for finding in prepared.session.findings] == ["fixes_without_georeference"]
    assert prepared.session.camera.fixes is None
    (survey / "floor_1").rename(survey / "floor_2")
    (survey / "site.toml").write_text(SITE.replace("number = 1", "number = 2"), encoding="utf-8")
    opened = open_survey(survey)
    prepared = prepared_session(SessionTask(opened.sessions[0], opened.site, Corrections()))
    assert [finding.kind for finding in prepared.session.findings] == ["too_few_fixes"]


def test_a_log_without_inertial_readings_is_told(survey: Path) -> None:
    file = next(survey.rglob("T01.txt"))
    lines = file.read_text(encoding="utf-8").splitlines(keepends=True)
    file.write_text("".join(line for line in lines if not line.startswith("GYRO")), encoding="utf-8")
    with pytest.raises(SessionError, match=r"T01\.txt has no accelerometer and gyroscope"):
        read_session(open_survey(survey).sessions[0])


def test_air_pressure_tells_of_a_rise(survey: Path) -> None:
    (survey / "site.toml").write_text(f"{SITE}elevation_m = 3.5\n", encoding="utf-8")
    file = next(survey.rglob("T01.txt"))
    rises_m = {at: 3.5 * min(max(at - 15, 0) / 8, 1) for at in np.arange(0.0, 37.0, 0.1).tolist()}
    pressure = [f"PRES;{at:.3f};{at + BOOT_S:.3f};{1000 - 0.12 * rise:.4f};0" for at, rise in rises_m.items()]
    rows = [line for line in file.read_text(encoding="utf-8").splitlines() if not line.startswith("%")]
    rows = sorted(rows + pressure, key=lambda row: float(row.split(";")[1]))
    file.write_text(HEAD + "\n".join(rows) + "\n", encoding="utf-8")
    opened = open_survey(survey)
    prepared = prepared_session(SessionTask(opened.sessions[0], opened.site, Corrections()))
    strategy = strategy_named(WITHOUT_TRACKER, MappingSettings())
    walk = strategy.map(prepared.session.camera, prepared.session.landmarks, prepared.landmarks)
    assert np.ptp(walk.position_bcs[:, 2]) == pytest.approx(3.5, abs=0.4)
    assert EventKind.STAIRS in {event.kind for event in walk.events}
