"""Walks as tables with headers: each layout gives what the published layout of the same walk gives."""

from __future__ import annotations

import shutil
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from scipy.spatial.transform import Rotation

from tests.surveys import make_survey
from vislam2tag.common.errors import SessionError
from vislam2tag.sessions.model import Session
from vislam2tag.sessions.prepared import SessionTask, prepared_session
from vislam2tag.sessions.registry import open_survey, read_session
from vislam2tag.site.corrections.file import Corrections

POSE = ["px", "py", "pz", "qx", "qy", "qz", "qw"]
NAMES = {
    "poses.csv": ["t", *POSE],
    "initPoses.csv": ["marker", "t", *POSE],
    "wifi.csv": ["scan", "t", "kind", "ssid", "mac", "rssi"],
    "sensors.csv": ["t", "type", *(f"v{i}" for i in range(1, 7))],
}
Tables = dict[str, pd.DataFrame]


def raw(folder: Path) -> Tables:
    """The published files of a session, read by pandas; times in ns."""
    tables = {}
    for name, columns in NAMES.items():
        decimal = "," if b"," in (folder / name).read_bytes() else "."
        table = pd.read_csv(folder / name, sep=r";\s*", header=None, engine="python", decimal=decimal)
        tables[name] = table.set_axis(columns, axis=1)
    tables["wifi.csv"]["t"] *= 1000
    return tables


def own_names(tables: Tables, folder: Path) -> None:
    for name, table in tables.items():
        table.to_csv(folder / name, index=False)


def decimal_commas(tables: Tables, folder: Path) -> None:
    for name, table in tables.items():
        table.to_csv(folder / name, index=False, sep=";", decimal=",")


def separator_line(tables: Tables, folder: Path) -> None:
    for name, table in tables.items():
        (folder / name).write_text("sep=;\n" + table.to_csv(index=False, sep=";"), encoding="utf-8")


def pandas_index(tables: Tables, folder: Path) -> None:
    for name, table in tables.items():
        table.to_csv(folder / name, sep="\t")


def seconds(tables: Tables, folder: Path) -> None:
    for name, table in tables.items():
        renamed = table.assign(t=[f"{t // 10**9}.{t % 10**9:09d}" for t in table["t"]])
        renamed.rename(columns={"t": "time_s"}).to_csv(folder / name, index=False)


def microseconds(tables: Tables, folder: Path) -> None:
    for name, table in tables.items():
        table.assign(t=table["t"] // 1000).rename(columns={"t": "timestamp [us]"}).to_csv(folder / name, index=False)


def unix_times(tables: Tables, folder: Path) -> None:
    for name, table in tables.items():
        table.assign(t=table["t"] + 1_700_000_000 * 10**9).to_csv(folder / name, index=False)


def real_part_first_z_up(tables: Tables, folder: Path) -> None:
    z_up = Rotation.from_euler("x", 90, degrees=True)
    for name, table in tables.items():
        if "qw" in table.columns:
            turned = (z_up * Rotation.from_quat(table[POSE[3:]].to_numpy())).as_quat()
            moved = z_up.apply(table[POSE[:3]].to_numpy())
            first = [column for column in table.columns if column not in POSE]
            values = np.column_stack((moved, turned[:, 3], turned[:, :3]))
            pose = pd.DataFrame(values, columns=["tx", "ty", "tz", "rot_w", "rot_x", "rot_y", "rot_z"])
            table = pd.concat((table[first], pose), axis=1)
        table.to_csv(folder / name, index=False)


def foreign_names(tables: Tables, folder: Path) -> None:
    poses = tables["poses.csv"].rename(columns={"px": "east_of_start", "py": "up"})
    for name, table in {**tables, "poses.csv": poses}.items():
        table.to_csv(folder / name, index=False)
    text = '[poses]\nx = "east_of_start"\ny = "up"\n'
    (folder.parent / "columns.toml").write_text(text, encoding="utf-8")


LAYOUTS = [
    own_names,
    decimal_commas,
    separator_line,
    pandas_index,
    seconds,
    microseconds,
    unix_times,
    real_part_first_z_up,
    foreign_names,
]


@pytest.fixture(scope="module")
def published(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return make_survey(tmp_path_factory.mktemp("published"), devices=("LG",), seconds=40)


def session_of(root: Path) -> Session:
    survey = open_survey(root)
    return prepared_session(SessionTask(survey.sessions[0], survey.site, Corrections())).session


def rewritten(published: Path, out: Path, layout: Callable[[Tables, Path], None]) -> Path:
    """A copy of the survey whose session is in another layout; returns the session's folder."""
    shutil.copytree(published, out)
    (folder,) = out.glob("floor_*/*/*")
    tables = raw(folder)
    for name in tables:
        (folder / name).unlink()
    layout(tables, folder)
    return folder


@pytest.mark.parametrize("layout", LAYOUTS)
def test_each_layout_is_the_same_walk(published: Path, tmp_path: Path, layout: Callable[[Tables, Path], None]) -> None:
    root = tmp_path / "survey"
    rewritten(published, root, layout)
    assert [ref.format for ref in open_survey(root).sessions] == ["csv-walk"]
    ours, theirs = session_of(root), session_of(published)
    np.testing.assert_allclose(ours.camera.position_acs, theirs.camera.position_acs, atol=1e-3)
    cosine = np.abs(np.sum(ours.camera.orientation_acs * theirs.camera.orientation_acs, axis=1))
    assert 2 * np.degrees(np.arccos(cosine.clip(max=1))).max() < 1
    assert ours.landmarks.ids == theirs.landmarks.ids
    np.testing.assert_array_equal(ours.landmarks.frame, theirs.landmarks.frame)
    np.testing.assert_allclose(ours.landmarks.position_acs, theirs.landmarks.position_acs, atol=1e-3)
    since = [each.camera.time_ns[0] for each in (ours, theirs)]
    for name in ("wifi", "sensors"):
        times = [
            each.tables[name]["time_ns"].to_numpy() - start for each, start in zip((ours, theirs), since, strict=True)
        ]
        np.testing.assert_allclose(times[0], times[1], atol=2000)
    assert ours.tables["wifi"]["rssi_dbm"].equals(theirs.tables["wifi"]["rssi_dbm"])
    assert "columns_guessed" in {each.kind for each in ours.findings}
    assert "[poses]" in ours.columns


def test_a_column_that_is_not_recognised_is_asked_for_by_name(published: Path, tmp_path: Path) -> None:
    def layout(tables: Tables, folder: Path) -> None:
        own_names({**tables, "poses.csv": tables["poses.csv"].rename(columns={"px": "abscissa"})}, folder)

    rewritten(published, tmp_path / "survey", layout)
    ref = open_survey(tmp_path / "survey").sessions[0]
    expected = r"found the columns t, abscissa.*expected for x one of x, px, tx.*\[poses\] x = \"abscissa\""
    with pytest.raises(SessionError, match=expected):
        read_session(ref)


def test_two_columns_for_one_role_are_asked_about(published: Path, tmp_path: Path) -> None:
    def layout(tables: Tables, folder: Path) -> None:
        poses = tables["poses.csv"]
        both = poses.assign(tx=poses["px"], ty=poses["py"], tz=poses["pz"])
        own_names({**tables, "poses.csv": both}, folder)

    rewritten(published, tmp_path / "survey", layout)
    ref = open_survey(tmp_path / "survey").sessions[0]
    with pytest.raises(SessionError, match=r"px and tx may both be x; choose one in columns\.toml"):
        read_session(ref)


def test_a_wrong_name_in_columns_toml_is_reported(published: Path, tmp_path: Path) -> None:
    folder = rewritten(published, tmp_path / "survey", own_names)
    (folder / "columns.toml").write_text('[poses]\nx = "pX"\n', encoding="utf-8")
    ref = open_survey(tmp_path / "survey").sessions[0]
    with pytest.raises(SessionError, match=r"poses\.csv has no such column \(the closest name is px\); found t, px"):
        read_session(ref)


def test_offsets_in_the_cameras_axes(published: Path, tmp_path: Path) -> None:
    def layout(tables: Tables, folder: Path) -> None:
        poses = tables["poses.csv"].set_index("t")
        seen = tables["initPoses.csv"]
        at = poses.loc[seen["t"]]
        turn = Rotation.from_quat(at[POSE[3:]].to_numpy())
        offset = turn.inv().apply(seen[POSE[:3]].to_numpy() - at[POSE[:3]].to_numpy())
        offsets = pd.DataFrame(offset, columns=["cam_x", "cam_y", "cam_z"])
        own_names({**tables, "initPoses.csv": pd.concat((seen[["t", "marker"]], offsets), axis=1)}, folder)

    rewritten(published, tmp_path / "survey", layout)
    ours, theirs = session_of(tmp_path / "survey"), session_of(published)
    np.testing.assert_allclose(ours.landmarks.position_acs, theirs.landmarks.position_acs, atol=1e-3)
