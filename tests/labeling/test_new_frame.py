"""Results of sessions in another frame.

Tables in another frame: what an unturned calculation gives, and there and back.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import polars as pl
import pytest
from hypothesis import given
from hypothesis import strategies as st
from polars.testing import assert_frame_equal
from scipy.spatial.transform import Rotation

from vislam2tag.core.status import EventKind
from vislam2tag.labeling.new_frame import changed_result, changed_table, floors_of_result
from vislam2tag.labeling.results import (
    CandidatePath,
    ContradictionMark,
    Drawing,
    EventMark,
    PlacingRecord,
    SessionResult,
    SigmaStatistics,
    Stretch,
    VisitMark,
)
from vislam2tag.site.frame_change import FrameChange

RESULT = SessionResult(
    slug="s",
    fingerprint="f",
    floor=0,
    device="d",
    session="s",
    format="published",
    strategy="smoother",
    version="1",
    distance_m=10.0,
    visits=[
        VisitMark(landmark="1", time_ns=0, distance_m=1.0, position=(1.0, 0.0)),
        VisitMark(landmark="2", time_ns=0, distance_m=1.0, position=None),
        VisitMark(landmark="3", time_ns=0, distance_m=1.0, position=(1.0, 0.0), floor=1),
    ],
    events=[EventMark(time_ns=0, kind=next(iter(EventKind)), size_m=1.0, turn_rad=None, position=(2.0, 0.0))],
    contradictions=[
        ContradictionMark(
            floor=0, landmark="1", size_m=1.0, sigma_m=0.1, passes=2, surveyed_m=(1.0, 1.0), offset_m=(1.0, 0.0)
        )
    ],
    sigma=SigmaStatistics(median_m=0.1, p95_m=0.2, uncertain_share=0.0, frames={1: 2}),
    drawing=Drawing(mapped=[Stretch(status="ok", points=[(1.0, 0.0), (2.0, 0.0)], sigma_m=[0.1, 0.2])], raw=[]),
    elsewhere={1: Drawing(wifi=[(1.0, 0.0)])},
)
TURN = {0: FrameChange(number=0, x_m=10, angle_deg=90), 1: FrameChange(number=1, y_m=5)}


def test_every_place_turns_with_its_floor() -> None:
    changed = changed_result(RESULT, TURN)
    assert [mark.position for mark in changed.visits] == [(10.0, 1.0), None, (1.0, 5.0)]
    assert changed.events[0].position == (10.0, 2.0)
    (contradiction,) = changed.contradictions
    assert (contradiction.surveyed_m, contradiction.offset_m) == ((9.0, 1.0), (0.0, 1.0))
    assert changed.drawing.mapped[0].points == [(10.0, 1.0), (10.0, 2.0)]
    assert changed.elsewhere[1].wifi == [(1.0, 5.0)]
    assert (changed.sigma, changed.distance_m) == (RESULT.sigma, 10.0)
    assert changed.fingerprint != RESULT.fingerprint
    assert changed.findings == []
    assert floors_of_result(RESULT) == {0, 1}


def test_the_paths_that_a_walk_may_have_taken_turn_with_its_floor() -> None:
    assert changed_result(RESULT, TURN).placing is None
    candidates = [CandidatePath(weight=0.6, points=[(1.0, 0.0), (2.0, 0.0)]), CandidatePath(weight=0.4, points=[])]
    placing = PlacingRecord(
        labelled_share=0.5, reason="ok", way_m=100.0, misfit=0.1, mirror=9.0, exchanged=8.0, candidates=candidates
    )
    changed = changed_result(RESULT.model_copy(update={"placing": placing}), TURN).placing
    assert changed is not None
    assert [path.points for path in changed.candidates] == [[(10.0, 1.0), (10.0, 2.0)], []]
    assert [path.weight for path in changed.candidates] == [0.6, 0.4]
    assert changed.model_copy(update={"candidates": candidates}) == placing


def test_statistics_of_another_scale_are_left_out_and_told() -> None:
    changed = changed_result(RESULT, {**TURN, 0: FrameChange(number=0, scale=2.0)})
    assert changed.sigma is None
    assert [finding.kind for finding in changed.findings] == ["statistics_left_out"]
    assert changed.distance_m == 20.0
    assert changed.drawing.mapped[0].sigma_m == pytest.approx([0.2, 0.4])
    assert changed.contradictions[0].size_m == 2.0


@dataclass(frozen=True)
class Pose:
    """One row of a trajectory."""

    floor: int
    x: float
    y: float
    angle: float
    long_m: float
    wide_m: float


poses = st.builds(
    Pose,
    floor=st.sampled_from([0, 1]),
    x=st.floats(-200, 200),
    y=st.floats(-200, 200),
    angle=st.floats(-3, 3),
    long_m=st.floats(0.1, 5),
    wide_m=st.floats(0.1, 5),
)
changes = st.builds(
    FrameChange,
    number=st.just(0),
    x_m=st.floats(-500, 500),
    y_m=st.floats(-500, 500),
    angle_deg=st.floats(-360, 360),
    scale=st.floats(0.5, 2),
    rise_m=st.floats(-50, 50),
)


def table_of(rows: list[Pose]) -> pl.DataFrame:
    turn = [Rotation.from_euler("zyx", (row.angle, 0.4, 0.2)).as_quat() for row in rows]
    axes = [np.array([[np.cos(r.angle), -np.sin(r.angle)], [np.sin(r.angle), np.cos(r.angle)]]) for r in rows]
    covariance = [a @ np.diag([r.long_m, r.wide_m]) @ a.T for a, r in zip(axes, rows, strict=True)]
    return pl.DataFrame(
        {
            "floor": pl.Series([row.floor for row in rows], dtype=pl.Int32),
            "x": [row.x for row in rows],
            "y": [row.y for row in rows],
            "z": [1.5] * len(rows),
            **{name: [quaternion[i] for quaternion in turn] for i, name in enumerate(("qx", "qy", "qz", "qw"))},
            "sigma": [row.long_m for row in rows],
            "cov_xx": [each[0, 0] for each in covariance],
            "cov_xy": [each[0, 1] for each in covariance],
            "cov_yy": [each[1, 1] for each in covariance],
            "heading_deg": [float(np.degrees(row.angle) % 360) for row in rows],
            "heading_rad": [row.angle for row in rows],
            "speed_m_s": [1.0] * len(rows),
            "status": ["ok"] * len(rows),
        }
    )


@given(rows=st.lists(poses, min_size=1, max_size=4), first=changes, second=changes)
def test_every_column_turns(rows: list[Pose], first: FrameChange, second: FrameChange) -> None:
    by_floor = {0: first, 1: second.model_copy(update={"number": 1})}
    old = table_of(rows)
    new = changed_table(old.lazy(), by_floor).collect()
    for row, before, after in zip(rows, old.iter_rows(named=True), new.iter_rows(named=True), strict=True):
        change = by_floor[row.floor].new_T_old
        place = change @ np.array([row.x, row.y])
        assert (after["x"], after["y"]) == pytest.approx(tuple(place), abs=1e-9)
        assert after["z"] == pytest.approx(1.5 + by_floor[row.floor].rise_m)
        assert after["sigma"] == pytest.approx(row.long_m * change.scale)
        matrix = change.scale * np.array(
            [
                [np.cos(change.rotation_rad), -np.sin(change.rotation_rad)],
                [np.sin(change.rotation_rad), np.cos(change.rotation_rad)],
            ]
        )
        covariance = np.array([[before["cov_xx"], before["cov_xy"]], [before["cov_xy"], before["cov_yy"]]])
        expected = matrix @ covariance @ matrix.T
        found = [[after["cov_xx"], after["cov_xy"]], [after["cov_xy"], after["cov_yy"]]]
        assert np.array(found) == pytest.approx(expected, abs=1e-9)
        turn = Rotation.from_euler("z", change.rotation_rad)
        old_q, new_q = ([each[name] for name in ("qx", "qy", "qz", "qw")] for each in (before, after))
        assert (turn * Rotation.from_quat(old_q)).approx_equal(Rotation.from_quat(new_q), 1e-8)
        ahead = np.exp(1j * (row.angle + change.rotation_rad))
        assert np.exp(1j * after["heading_rad"]) == pytest.approx(ahead, abs=1e-9)
        assert np.exp(1j * np.radians(after["heading_deg"])) == pytest.approx(ahead, abs=1e-9)
        assert 0 <= after["heading_deg"] <= 360
        assert after["speed_m_s"] == pytest.approx(change.scale)
    assert new.columns == old.columns
    assert new.schema == old.schema


@given(rows=st.lists(poses, min_size=1, max_size=4), change=changes)
def test_there_and_back(rows: list[Pose], change: FrameChange) -> None:
    both = {number: change.model_copy(update={"number": number}) for number in (0, 1)}
    back = {number: each.inverse for number, each in both.items()}
    old = table_of(rows)
    new = changed_table(changed_table(old.lazy(), both), back).collect()
    whole = ["heading_deg", "heading_rad"]  # 0 and 360 are the same
    assert_frame_equal(new.drop(whole), old.drop(whole), abs_tol=1e-8, rel_tol=1e-8)
    for name, full in zip(whole, (360.0, 2 * np.pi), strict=True):
        apart = (new[name] - old[name]).to_numpy()
        assert np.abs(apart - full * np.round(apart / full)).max() < 1e-8


def test_unknown_values_stay_unknown() -> None:
    table = pl.DataFrame({"floor": [0, None, 0], "x": [None, None, float("nan")], "y": [None, None, 1.0]})
    change = FrameChange(number=0, x_m=5, angle_deg=10)
    new = changed_table(table.lazy(), {0: change}).collect()
    assert new["x"].is_null().to_list() == [True, True, False]
    assert new["x"].is_nan().to_list() == [None, None, True]


def test_other_buildings_stay() -> None:
    table = pl.DataFrame({"building": ["a", "b", None], "floor": [0, 0, 0], "x": [1.0] * 3, "y": [2.0] * 3})
    change = {0: FrameChange(number=0, x_m=5)}
    assert changed_table(table.lazy(), change, "b").collect()["x"].to_list() == [1.0, 6.0, 1.0]
    assert changed_table(table.lazy(), change, "").collect()["x"].to_list() == [1.0, 1.0, 6.0]
