"""A walk from tables in memory has the positions that ``process`` gives its files."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import NamedTuple

import numpy as np
import pandas as pd
import polars as pl
import pytest
from hypothesis import given
from hypothesis import strategies as st
from polars.testing import assert_frame_equal

import vislam2tag as vt
from tests.surveys import make_survey
from vislam2tag.api import ProcessSettings, process
from vislam2tag.common.errors import SessionError, UsageError
from vislam2tag.labeling.mapped_walk import MappedWalk
from vislam2tag.labeling.results import SessionResult

POSE = ("tx", "ty", "tz", "qx", "qy", "qz", "qw")
SENSOR = ("v1", "v2", "v3", "v4", "v5", "v6")


class Walk(NamedTuple):
    poses: pl.DataFrame
    sightings: pl.DataFrame
    landmarks: pl.DataFrame
    sensors: pl.DataFrame
    labels: Path
    mapped: MappedWalk


def table(file: Path, columns: list[str]) -> pl.DataFrame:
    texts = pl.read_csv(file, separator=";", has_header=False, new_columns=columns, infer_schema=False)
    plain = texts.select(pl.all().str.strip_chars().str.replace(",", "."))
    numbers = [pl.col(name).cast(pl.Float64) for name in columns if name in POSE + SENSOR]
    return plain.with_columns(pl.col("time_ns").cast(pl.Int64), *numbers)


@pytest.fixture(scope="module")
def walk(tmp_path_factory: pytest.TempPathFactory) -> Walk:
    folder = tmp_path_factory.mktemp("in_memory")
    survey = make_survey(folder / "survey", devices=("LG",), seconds=60.0, severity="severe", seed=5)
    process(survey, folder / "labels")
    session = next((survey / "floor_0" / "LG").iterdir())
    poses = table(session / "poses.csv", ["time_ns", *POSE])
    sightings = table(session / "initPoses.csv", ["id", "time_ns", *POSE])
    sensors = table(session / "sensors.csv", ["time_ns", "sensor", *SENSOR])
    landmarks = pl.read_csv(survey / "floor_0" / "marker_dict.csv")
    mapped = vt.map_walk(poses, sightings, landmarks, sensors=sensors)
    return Walk(poses, sightings, landmarks, sensors, folder / "labels", mapped)


def test_frames_and_findings_are_those_of_process(walk: Walk) -> None:
    written = pl.read_parquet(walk.labels / "trajectory" / "*.parquet").drop("device", "session")
    assert walk.mapped.frames.select(written.columns).equals(written)
    assert walk.mapped.frames["sigma"].is_not_null().any()
    result = SessionResult.model_validate_json(next((walk.labels / "sessions").iterdir()).read_bytes())
    of_poses = {found.kind for found in result.findings if found.file not in ("wifi.csv", "refMarker.csv")}
    assert {found.kind for found in walk.mapped.findings} == of_poses


def test_labels_are_those_of_process(walk: Walk) -> None:
    wifi = pl.read_parquet(walk.labels / "wifi" / "*.parquet").filter(pl.col("status") != "duplicate")
    labels = ["x", "y", "z", "sigma", "status"]
    again = walk.mapped.label(wifi.drop("floor", *labels).rename({"time_ns": "t"}), "t")
    assert again.columns == [
        *("t" if name == "time_ns" else name for name in wifi.drop("floor", *labels).columns),
        *labels,
    ]
    assert again.select(labels).equals(wifi.select(labels))


def test_pandas_arrow_and_lazy_tables_give_the_same(walk: Walk) -> None:
    poses: pd.DataFrame = walk.poses.to_pandas()
    assert vt.map_walk(poses, walk.sightings.to_arrow(), walk.landmarks.lazy(), sensors=walk.sensors).frames.equals(
        walk.mapped.frames
    )
    labelled = walk.mapped.label(poses[["time_ns"]])
    assert labelled["x"].equals(walk.mapped.frames["x"])


def nullable(table: pd.DataFrame) -> pd.DataFrame:
    return table.convert_dtypes()


def of_arrow(table: pd.DataFrame) -> pd.DataFrame:
    return table.convert_dtypes(dtype_backend="pyarrow")


def of_objects(table: pd.DataFrame) -> pd.DataFrame:
    return table.astype(object)


def indexed(table: pd.DataFrame) -> pd.DataFrame:
    return table.set_index(table.columns[0])


def categorical(table: pd.DataFrame) -> pd.DataFrame:
    return table.astype({"id": str}).astype({"id": "category"}) if "id" in table else table


def floats(table: pd.DataFrame) -> pd.DataFrame:
    return table.assign(time_ns=table["time_ns"].astype(float)) if "time_ns" in table else table


def in_seconds(table: pd.DataFrame) -> pd.DataFrame:
    if "time_ns" not in table:
        return table
    return table.assign(time_ns=table["time_ns"] / 1e9).rename(columns={"time_ns": "time_s"})


def local(table: pd.DataFrame) -> pd.DataFrame:
    return table.assign(time_ns=pd.to_datetime(table["time_ns"])) if "time_ns" in table else table


def dated(table: pd.DataFrame) -> pd.DataFrame:
    if "time_ns" not in table:
        return table
    times = pd.to_datetime(table["time_ns"], utc=True).dt.tz_convert("Europe/Berlin")
    return table.assign(time_ns=times)


@pytest.mark.parametrize(
    "kind", [nullable, of_arrow, of_objects, indexed, categorical, floats, in_seconds, local, dated]
)
def test_every_kind_of_pandas_table_gives_the_same(walk: Walk, kind: Callable[[pd.DataFrame], pd.DataFrame]) -> None:
    tables = [kind(table.to_pandas()) for table in (walk.poses, walk.sightings, walk.landmarks)]
    mapped = vt.map_walk(*tables, sensors=kind(walk.sensors.to_pandas()))
    assert mapped.frames.equals(walk.mapped.frames)
    assert mapped.label(tables[0])["sigma"].equals(walk.mapped.frames["sigma"])


def test_columns_are_recognised_by_usual_headers(walk: Walk) -> None:
    names = {"tx": "pos_x [mm]", "ty": "pos_y [mm]", "tz": "pos_z [mm]", "time_ns": "time_us", "id": "marker_id"}
    names |= {f"q{axis}": f"quat_{axis}" for axis in "xyzw"}

    def headed(table: pl.DataFrame) -> pd.DataFrame:
        frame = table.to_pandas()
        millimetres = {name: frame[name] * 1000 for name in ("tx", "ty", "tz")}
        return frame.assign(**millimetres, time_ns=frame["time_ns"] / 1000).rename(columns=names)

    landmarks = walk.landmarks.to_pandas().rename(columns={"id": "tag", "x": "east", "y": "north"})
    mapped = vt.map_walk(headed(walk.poses), headed(walk.sightings), landmarks, sensors=walk.sensors)
    columns = ["x", "y", "z", "sigma", "status"]
    assert_frame_equal(mapped.frames.select(columns), walk.mapped.frames.select(columns), abs_tol=1e-5)
    labelled = mapped.label(walk.poses.select(walk.poses["time_ns"].alias("timestamp"))).to_pandas()
    assert np.allclose(labelled["x"], walk.mapped.frames["x"], atol=1e-5, equal_nan=True)


def test_a_frame_with_z_up_and_offsets_from_the_camera_give_the_same(walk: Walk) -> None:
    from scipy.spatial.transform import Rotation

    poses, seen = (
        walk.poses,
        walk.sightings.join(walk.poses.select("time_ns", pl.col(POSE).name.suffix("_c")), "time_ns"),
    )
    upright = Rotation.from_euler("x", 90, degrees=True)  # y to z
    turned = upright * Rotation.from_quat(poses.select(POSE[3:]).to_numpy())
    at = upright.apply(poses.select(POSE[:3]).to_numpy())
    z_up = poses.select("time_ns").hstack(
        [pl.Series(n, v) for n, v in zip(POSE, np.hstack((at, turned.as_quat())).T, strict=True)]
    )
    camera = Rotation.from_quat(seen.select(f"{name}_c" for name in POSE[3:]).to_numpy())
    apart = seen.select(POSE[:3]).to_numpy() - seen.select(f"{name}_c" for name in POSE[:3]).to_numpy()
    offset = camera.inv().apply(apart)
    sightings = seen.select("id", "time_ns").hstack(
        [pl.Series(f"cam_{axis}", v) for axis, v in zip("xyz", offset.T, strict=True)]
    )
    mapped = vt.map_walk(z_up, sightings, walk.landmarks.drop("heading_rad", strict=False), sensors=walk.sensors)
    assert "columns_guessed" in {found.kind for found in mapped.findings}
    both = (mapped.frames["status"] == "ok") & (walk.mapped.frames["status"] == "ok")
    assert both.sum() > 0.8 * int((walk.mapped.frames["status"] == "ok").sum())
    apart_m = (
        mapped.frames.filter(both).select("x", "y") - walk.mapped.frames.filter(both).select("x", "y")
    ).to_numpy()
    assert np.abs(apart_m).max() < 0.1


@given(st.data())
def test_labels_at_the_times_of_frames_are_the_frames(walk: Walk, data: st.DataObject) -> None:
    frames = walk.mapped.frames.filter(~pl.col("status").is_in(["invalid", "duplicate"]))
    chosen = frames[data.draw(st.lists(st.integers(0, frames.height - 1), max_size=30))]
    labelled = walk.mapped.label(chosen.select("time_ns"))
    assert labelled.equals(chosen.select(labelled.columns))


def test_a_walk_that_cannot_be_mapped_says_why(walk: Walk) -> None:
    result = vt.map_walk(walk.poses, walk.sightings, walk.landmarks.head(1))
    assert set(result.frames["status"]) == {"no_mapping"}
    assert result.frames["x"].null_count() == result.frames.height
    assert result.frames["cause"].null_count() == 0
    assert "too_few_landmarks" in {found.kind for found in result.findings}
    nothing = vt.map_walk(walk.poses.head(0), walk.sightings.head(0), walk.landmarks.head(0))
    assert nothing.frames.columns == result.frames.columns
    assert [found.kind for found in nothing.findings] == ["no_frames"]


def test_poses_of_another_convention_are_refused(walk: Walk) -> None:
    with pytest.raises(SessionError, match="floor 0 / in memory / walk: poses: "):
        vt.map_walk(walk.poses.with_columns(pl.col("tx", "ty", "tz") * 100), walk.sightings, walk.landmarks)


def test_headings_of_landmarks_need_orientations_of_sightings(walk: Walk) -> None:
    with pytest.raises(UsageError, match="landmarks, column heading_rad: the sightings have no orientations"):
        vt.map_walk(walk.poses, walk.sightings.drop(POSE[3:]), walk.landmarks.with_columns(heading_rad=0.0))


def test_settings_and_floor_are_taken(walk: Walk) -> None:
    settings = ProcessSettings(strategy="local")
    result = vt.map_walk(walk.poses, walk.sightings, walk.landmarks, floor=4, settings=settings)
    assert result.frames["floor"].unique().to_list() == [4]
    assert result.frames["sigma"].null_count() == result.frames.height
    assert "before_first_landmark" in set(result.frames["status"])


def test_columns_that_are_there_already_or_missing_are_refused(walk: Walk) -> None:
    times = walk.poses.select("time_ns")
    with pytest.raises(UsageError, match="table: the column x and status already exists; rename it"):
        walk.mapped.label(times.with_columns(x=0.0, status=0))
    with pytest.raises(UsageError, match="table: the column t is missing; it has time_ns"):
        walk.mapped.label(times, "t")


def test_labels_of_another_unit_name_it(walk: Walk) -> None:
    us = walk.poses.select(walk.poses["time_ns"] // 1000)
    with pytest.raises(
        UsageError, match=r"no row is within the walk.*multiplied by 1,000: rename the column to time_us"
    ):
        walk.mapped.label(us)
    assert walk.mapped.label(us.rename({"time_ns": "time_us"}))["x"].is_not_null().any()
    assert walk.mapped.label(us.rename({"time_ns": "t_us"}), "t_us")["x"].is_not_null().any()
    with pytest.raises(UsageError, match=r"Its times are 5 to 5 ns, those of the walk \d+ to \d+ ns"):
        walk.mapped.label(pl.DataFrame({"time_ns": [5]}))


def test_rows_without_a_time_stay_and_are_invalid(walk: Walk) -> None:
    times = walk.poses["time_ns"].cast(pl.Float64).to_list()
    labelled = walk.mapped.label(pd.DataFrame({"time_ns": [None, times[500]]}))
    assert labelled["status"].to_list() == ["invalid", walk.mapped.frames["status"][500]]
    assert labelled["x"].to_list() == [None, walk.mapped.frames["x"][500]]


def test_headings_are_where_the_camera_looks(walk: Walk) -> None:
    placed = walk.mapped.frames.filter(pl.col("x").is_not_null())
    quaternion = placed.select("qx", "qy", "qz", "qw").to_numpy()
    x, y, z, w = quaternion.T
    looks = np.column_stack((-2 * (x * z + w * y), -2 * (y * z - w * x)))  # minus the rotation's third column
    level = np.hypot(*looks.T) > 0.5
    assert level.mean() > 0.9
    assert np.allclose(np.arctan2(looks[level, 1], looks[level, 0]), placed["heading_rad"].to_numpy()[level])


def test_it_shows_itself_in_a_notebook(walk: Walk) -> None:
    assert "<th>median sigma</th>" in walk.mapped._repr_html_()
    assert repr(walk.mapped).startswith(f"MappedWalk(frames: {walk.poses.height}, ")
