"""Scans of a file or a data set become rows of positions, known ones with all they have, unknown ones with nothing."""

from __future__ import annotations

import io
import json
import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pandas as pd
import polars as pl
import pytest

from tests.datasets.factory import bssid, small_dataset
from tests.positioning.radio_world import STOREYS
from vislam2tag.common.errors import DatasetError, UsageError
from vislam2tag.datasets.folder import open_dataset, write_dataset
from vislam2tag.datasets.model import RoomInfo
from vislam2tag.datasets.privacy import Privacy, hashed, key_name, with_privacy
from vislam2tag.datasets.splits import standard_splits
from vislam2tag.pipeline.positioning import locate as module
from vislam2tag.pipeline.positioning.locate import LOCATED, LocatedScans, WalkPlan, locate, located_table
from vislam2tag.pipeline.positioning.train import TrainPlan, train
from vislam2tag.positioning import scan_file
from vislam2tag.positioning.model_files import FloorName, ModelOrigin
from vislam2tag.positioning.places import Positions
from vislam2tag.positioning.settings import SequenceMethod
from vislam2tag.positioning.tracks import Tracks

KEY = b"0123456789abcdef-secret"


@pytest.fixture(scope="module")
def places(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A plain and a hashed data set, and a model of each."""
    root = tmp_path_factory.mktemp("places")
    small = small_dataset()
    write_dataset(replace(small, splits=standard_splits(small)), root / "plain")
    write_dataset(with_privacy(small, Privacy(hash_key=KEY)), root / "hashed")
    for name in ("plain", "hashed"):
        train(root / name, TrainPlan("weighted-knn", {"k": 1}), root / f"{name}.v2t")
    small.readings.select("scan_id", "bssid", "rssi_dbm").collect().write_csv(root / "scans.csv")
    return root


def located(
    model: Path, scans: Path, *, as_json: bool = False, key: bytes | None = None, walks: WalkPlan | None = None
) -> tuple[pl.DataFrame, LocatedScans]:
    text = io.StringIO()
    found = locate(model, scans, text.write, as_json=as_json, key=key, walks=walks)
    if as_json:
        return pl.DataFrame(
            [json.loads(line) for line in text.getvalue().splitlines()], infer_schema_length=None
        ), found
    return pl.read_csv(text.getvalue().encode()), found


def test_learned_scans_are_where_they_were(places: Path) -> None:
    rows, found = located(places / "plain.v2t", places / "plain")
    truth = small_dataset().fingerprints.filter(pl.col("x").is_not_null()).collect()
    known = rows.join(truth, on="scan_id", suffix="_true")
    assert known.height == 44
    assert (known["x"] - known["x_true"]).abs().max() == pytest.approx(0, abs=1e-3)
    assert (known["floor"] == known["floor_true"]).all()
    assert (found.scans, found.unknown, found.access_points) == (48, 0, 10)
    assert (found.findings, found.advice) == ((), None)


def test_files_and_data_sets_say_the_same(places: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    rows, _ = located(places / "plain.v2t", places / "plain")
    assert located(places / "plain.v2t", places / "scans.csv")[0].sort("scan_id").equals(rows.sort("scan_id"))
    assert (
        located(places / "plain.v2t", places / "plain", as_json=True)[0]
        .select("scan_id", "x", "floor")
        .equals(rows.select("scan_id", "x", "floor"))
    )
    monkeypatch.setattr(module, "SCANS_AT_ONCE", 5)
    assert located(places / "plain.v2t", places / "plain")[0].equals(rows)


def test_strangers_are_unknown_and_case_does_not_matter(places: Path, tmp_path: Path) -> None:
    near = bssid(0, 2).upper()
    (tmp_path / "scans.csv").write_text(
        f"scan_id,bssid,rssi_dbm\nfar,aa:bb:cc:dd:ee:ff,-50\nnear,{near},-45\nnear,x,100\nbad,{near},loud\n"
    )
    rows, found = located(places / "plain.v2t", tmp_path / "scans.csv")
    assert rows["status"].to_list() == ["unknown", "unlike", "unknown"]  # one of ten is heard
    assert (
        rows.filter(pl.col("status") == "unknown").select(pl.exclude("scan_id", "status")).null_count().row(0)
        == (2,) * 10
    )
    assert (found.scans, found.unknown) == (3, 2)
    assert {finding.kind: finding.lines for finding in found.findings} == {
        "absurd_levels": (4,),
        "malformed_lines": (5,),
    }


def test_hashed_models_take_the_key_or_hashed_scans(places: Path, tmp_path: Path) -> None:
    rows, _ = located(places / "plain.v2t", places / "scans.csv")
    with_key, found = located(places / "hashed.v2t", places / "scans.csv", key=KEY)
    assert with_key.equals(rows)
    assert found.advice is None
    assert located(places / "hashed.v2t", places / "plain", key=KEY)[0].sort("scan_id").equals(rows.sort("scan_id"))
    assert located(places / "hashed.v2t", places / "hashed")[0].sort("scan_id").equals(rows.sort("scan_id"))
    plain, found = located(places / "hashed.v2t", places / "scans.csv")
    assert (plain["status"] == "unknown").all()
    assert found.advice is not None
    for word in (key_name(KEY), "--hash-bssid", "32 hex digits of HMAC-SHA256", "lower case"):
        assert word in found.advice
    (tmp_path / "scans.csv").write_text(f"scan_id,bssid,rssi_dbm\na,{hashed(bssid(0, 1), KEY)},-50\n")
    assert located(places / "hashed.v2t", tmp_path / "scans.csv")[0]["status"].to_list() == ["unlike"]


@pytest.mark.parametrize(
    ("model", "scans", "key", "message"),
    [
        ("plain.v2t", "scans.csv", KEY, "--hash-bssid: the model's access points have plain identifiers"),
        ("hashed.v2t", "scans.csv", KEY + b"!", "--hash-bssid: the model's data set was hashed with key"),
        ("hashed.v2t", "hashed", KEY, "small is already hashed"),
        ("hashed.v2t", "plain", None, "small contains plain identifiers, but the model's access points are hashed"),
        ("plain.v2t", "hashed", None, "small is hashed with key .* the model's access points are plain"),
    ],
)
def test_what_is_hashed_otherwise_is_told(
    places: Path, model: str, scans: str, key: bytes | None, message: str
) -> None:
    with pytest.raises(UsageError, match=message):
        located(places / model, places / scans, key=key)


def written_walks(rows: pl.DataFrame, path: Path) -> Path:
    """The scans of a data set's walk as a file that tells session and time."""
    rows.select("scan_id", "bssid", "rssi_dbm", "session", time_ns="start_ns").write_csv(path)
    return path


def test_scans_of_a_walk_help_each_other(places: Path, tmp_path: Path) -> None:
    dataset = open_dataset(places / "plain")
    readings = dataset.readings.join(dataset.fingerprints, on="scan_id", maintain_order="left").collect()
    file = written_walks(readings, tmp_path / "walks.csv")
    track = readings.select("session", "x", "y", time_ns="start_ns").unique().with_columns(pl.col("x", "y").round(1))
    track.write_csv(tmp_path / "track.csv")
    model = places / "plain.v2t"
    alone, none = located(model, file)
    assert (none.in_walks, none.tracked) == (0, 0)
    smooth, found = located(model, file, walks=WalkPlan(SequenceMethod.SMOOTHER))
    assert (found.in_walks, found.tracked) == (found.scans, 0)
    assert smooth["scan_id"].equals(alone["scan_id"])
    assert not smooth["x"].equals(alone["x"])
    causal, _ = located(model, file, walks=WalkPlan(SequenceMethod.FILTER))
    assert not causal["x"].equals(smooth["x"])
    tracked, found = located(model, file, walks=WalkPlan(SequenceMethod.SMOOTHER, Tracks(tmp_path / "track.csv")))
    assert found.tracked > found.scans / 2
    assert not tracked["x"].equals(smooth["x"])
    of_set, _ = located(model, places / "plain", walks=WalkPlan(SequenceMethod.SMOOTHER))
    assert of_set.filter(pl.col("scan_id").is_in(smooth["scan_id"].implode())).height == smooth.height


def test_walks_must_be_told_and_whole(places: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    plan = WalkPlan(SequenceMethod.FILTER)
    with pytest.raises(UsageError, match="need the columns session and time_ns"):
        located(places / "plain.v2t", places / "scans.csv", walks=plan)
    monkeypatch.setattr(scan_file, "SCANS_AT_ONCE", 1)
    head = "scan_id,bssid,rssi_dbm,session,time_ns\n"
    rows = [f"{scan},{bssid(0, 2)},-50,{walk},{time_ns}\n" for scan, walk, time_ns in (("a", "w", 1), ("b", "v", 2))]
    (tmp_path / "scans.csv").write_text(head + "".join(rows) + rows[0].replace("a,", "c,", 1))
    with pytest.raises(DatasetError, match="scans of session w are not consecutive"):
        located(places / "plain.v2t", tmp_path / "scans.csv", walks=plan)


HALL = RoomInfo(name="Hall", boxes_m=((0.0, 0.0, 2.9, 9.0), (2.9, 3.0, 3.5, 4.5)))
EAST_1 = FloorName(building="east", number=1, name="First floor", rooms=(HALL,))
NAMED = ModelOrigin(dataset="small", scans=3, floor_names=(EAST_1,))


def test_known_and_unknown_rows() -> None:
    found = Positions(
        storeys=STOREYS,
        storey=np.array([2, 1, 0]),
        xy=np.array([[1.23456, -2.0], [3.0, 4.0], [5.0, 6.0]]),
        z=np.array([np.nan, 3.0, 1.0]),
        storey_probability=np.array([[0.1, 0.2, 0.7], [0.0, 1.0, 0.0], [1.0, 0.0, 0.0]]),
        radius_68_m=np.full(3, 2.0),
        radius_95_m=np.full(3, 4.0),
    ).without(np.array([False, False, True]))
    table = located_table(np.array(["a", "b", "c"]), found, NAMED)
    assert dict(table.schema) == LOCATED
    assert table.rows() == [
        ("a", "ok", "west", 0, None, None, 1.235, -2.0, None, 2.0, 4.0, 0.7),
        ("b", "ok", "east", 1, "First floor", "Hall", 3.0, 4.0, 3.0, 2.0, 4.0, 1.0),
        ("c", "unknown", *[None] * 10),
    ]
    unlike = np.array([True, False, True])
    told = replace(found, unlike=unlike).without(~found.known)
    marked = located_table(np.array(["a", "b", "c"]), told, NAMED)
    expected = ["unlike" if one == "ok" and mark else one for one, mark in zip(table["status"], unlike, strict=True)]
    assert marked["status"].to_list() == expected
    assert "unlike" in expected
    assert "unknown" in expected
    assert located_table(np.array([], dtype=np.str_), found[:0], NAMED).height == 0


def test_a_wide_table_is_refused_with_how_to_make_it_long(
    places: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    long = pl.read_csv(places / "scans.csv")
    wide = pd.DataFrame(long.pivot("bssid", index="scan_id", values="rssi_dbm", aggregate_function="first").to_dict())
    wide.drop(columns="scan_id").to_csv(tmp_path / "wide.csv", index=False)
    with pytest.raises(DatasetError) as caught:
        locate(places / "plain.v2t", tmp_path / "wide.csv", io.StringIO().write)
    points = [name for name in wide.columns if name != "scan_id"]
    assert f"is a wide table, with {len(points)} columns of access points such as {points[0]};" in str(caught.value)
    (advice,) = re.findall(r"in pandas: (table.*), without the level", str(caught.value))
    monkeypatch.chdir(tmp_path)
    eval(advice, {"table": pd.read_csv("wide.csv"), "ACCESS_POINTS": points})
    rows, _ = located(places / "plain.v2t", tmp_path / "scans.csv")
    assert rows.height == long["scan_id"].n_unique()
