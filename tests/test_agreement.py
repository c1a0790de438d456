"""Agreement with the published program on the sessions of ../shared/data/agreement (no named defect in play)."""

from __future__ import annotations

from functools import cache
from pathlib import Path

import numpy as np
import polars as pl
import pytest

from vislam2tag.core.arrays import FloatArray, IntArray
from vislam2tag.core.status import Status
from vislam2tag.core.tracks import Trajectory
from vislam2tag.estimation.settings import MappingSettings
from vislam2tag.estimation.strategy import strategy_named
from vislam2tag.labeling.settings import LabelRule, LabelSettings
from vislam2tag.labeling.tables import label_readings
from vislam2tag.sessions.model import Session
from vislam2tag.sessions.registry import open_survey, read_session

PUBLISHED = {
    "local": "coords_local_raw_post",
    "local-corrected": "coords_local_post",
    "global": "coords_global_post",
    "global-affine": "coords_global_affine_post",
}
TOLERANCE_M = 0.001


@cache
def sessions(root: Path) -> list[tuple[Session, Path]]:
    """Each session with the folder of what the published program made of it."""
    survey = open_survey(root / "raw")
    return [
        (read_session(ref), root / "published-output" / ref.folder.relative_to(root / "raw")) for ref in survey.sessions
    ]


def mapped(session: Session, root: Path, strategy: str) -> Trajectory:
    landmarks = open_survey(root / "raw").site.landmarks
    return strategy_named(strategy, MappingSettings()).map(session.camera, session.landmarks, landmarks)


def published_positions(folder: Path, stem: str) -> tuple[IntArray, FloatArray]:
    positions = np.genfromtxt(folder / f"{stem}.csv", delimiter=",").reshape(-1, 2)
    times = np.round(np.genfromtxt(folder / f"{stem}_time.csv")).astype(np.int64)
    kept = np.isfinite(positions).all(axis=1)
    return times[kept], positions[kept]


@pytest.mark.parametrize("strategy", PUBLISHED)
@pytest.mark.parametrize("number", range(6))
def test_the_same_frames_within_a_millimetre(agreement: Path, strategy: str, number: int) -> None:
    session, folder = sessions(agreement)[number]
    trajectory = mapped(session, agreement, strategy)
    time_ns, positions = published_positions(folder, PUBLISHED[strategy])
    ok = trajectory.status == Status.OK
    np.testing.assert_array_equal(trajectory.time_ns[ok], time_ns)
    assert np.linalg.norm(trajectory.position_bcs[ok, :2] - positions, axis=1).max() < TOLERANCE_M


@pytest.mark.parametrize("table", ["wifi", "sensors"])
@pytest.mark.parametrize("number", range(6))
def test_annotated_readings_agree_row_by_row(agreement: Path, table: str, number: int) -> None:
    session, folder = sessions(agreement)[number]
    file = folder / f"{table}_annotated.csv"
    if not file.exists():
        assert table == "sensors"
        pytest.skip("the published program annotated no IMU file of this session")
    published = pl.read_csv(file).with_columns(pl.col("x_coord", "y_coord").cast(pl.Float64))
    trajectory = mapped(session, agreement, "local-corrected")
    readings = session.tables[table].with_columns(repeated=pl.lit(value=False))
    labelled = label_readings(readings, trajectory, LabelSettings(rule=LabelRule.NEXT_FRAME))
    ours = labelled.join(published.select("time").unique(), left_on="time_ns", right_on="time")
    ours = ours.sort("time_ns", maintain_order=True)
    assert len(ours) == len(published)
    assert ours["x"].count() == labelled["x"].count()  # rows that the published program leaves out have no label
    assert ours["x"].is_null().to_list() == published["x_coord"].is_null().to_list()
    difference = ours.select("x", "y").to_numpy() - published.select("x_coord", "y_coord").to_numpy()
    assert np.nanmax(np.abs(difference), initial=0.0) < TOLERANCE_M
