"""MCAP for Foxglove, opened with the reader of the format's makers and checked against their schemas."""

from __future__ import annotations

import base64
import json
import shutil
from collections import defaultdict
from pathlib import Path
from typing import Any

import jsonschema  # type: ignore[import-untyped]
import numpy as np
import polars as pl
import pytest
from mcap.reader import make_reader
from PIL import Image

from tests.datasets.formats.test_tum import with_covariances
from vislam2tag.common.errors import DatasetError
from vislam2tag.common.files.folder import Folder
from vislam2tag.datasets.format_registry import ExportContext, export_named
from vislam2tag.datasets.formats.mcap import foxglove_schemas
from vislam2tag.datasets.labelled import open_labelled

Messages = dict[str, list[tuple[int, dict[str, Any]]]]


CHECKED = 50
"""Validating takes a millisecond a message."""


def exported(labels: Path, folder: Path, context: ExportContext | None = None) -> None:
    writer = export_named("mcap").write_labels
    assert writer is not None
    writer(labels, Folder.at(folder), context or ExportContext())


def opened(path: Path) -> Messages:
    """Messages by topic, one of :data:`CHECKED` valid by the schema that the file says it has."""
    found: Messages = defaultdict(list)
    checks: dict[str, Any] = {}
    with path.open("rb") as file:
        for schema, channel, message in make_reader(file).iter_messages():
            assert schema is not None
            assert (schema.encoding, channel.message_encoding) == ("jsonschema", "json")
            if schema.name not in checks:
                own = json.loads(schema.data)
                if schema.name.startswith("foxglove."):
                    assert own == foxglove_schemas()[schema.name]
                checks[schema.name] = jsonschema.Draft7Validator(own)
            content = json.loads(message.data)
            if not len(found[channel.topic]) % CHECKED:
                checks[schema.name].validate(content)
            found[channel.topic].append((message.log_time, content))
    return found


@pytest.fixture
def placed(labels: Path, tmp_path: Path) -> Path:
    """Labels whose floors have a place on the earth."""
    shutil.copytree(labels, tmp_path / "labels")
    path = tmp_path / "labels" / "run.json"
    run = json.loads(path.read_text(encoding="utf-8"))
    for floor in run["floors"]:
        floor["georeference"] = {"latitude_deg": 49.4, "longitude_deg": 11.1, "bearing_deg": 90.0}
    path.write_text(json.dumps(run), encoding="utf-8")
    return with_covariances(tmp_path / "labels")


def test_every_message_is_valid_and_says_what_the_labels_say(placed: Path, tmp_path: Path) -> None:
    exported(placed, tmp_path / "out")
    session = open_labelled(placed).sessions[0]
    found = opened(tmp_path / "out" / f"{session.slug}.mcap")
    frames = session.table("trajectory", ("floor", "time_ns", "x", "y", "qz", "cov_xx", "cov_yy", "status"))
    known = frames.filter(pl.col("x").is_not_null())
    assert [time_ns for time_ns, _ in found["/pose"]] == known["time_ns"].to_list()
    poses = [content["pose"]["position"] for _, content in found["/pose"]]
    np.testing.assert_allclose([(each["x"], each["y"]) for each in poses], known.select("x", "y").to_numpy())
    assert found["/pose"][0][1]["frame_id"] == f"floor_{known['floor'][0]}"
    assert len(found["/tf"]) == len(found["/fix"]) == known.height
    covariance = np.array([content["position_covariance"] for _, content in found["/fix"]]).reshape(-1, 3, 3)
    np.testing.assert_allclose(covariance[:, 1, 1], known["cov_xx"].to_numpy(), atol=1e-12)
    np.testing.assert_allclose(covariance[:, 0, 0], known["cov_yy"].to_numpy(), atol=1e-12, err_msg="y points east")
    wifi = session.table("wifi", ("time_ns", "bssid", "x"))
    assert [(content["bssid"], content["x"]) for _, content in found["/labels/wifi"]] == list(
        wifi.sort("time_ns", maintain_order=True).select("bssid", "x").iter_rows()
    )
    assert {topic for topic in found if topic.startswith("/plan")} == {
        f"/plan/floor_{floor.number}" for floor in open_labelled(placed).floors
    }


def test_the_plans_of_the_survey_are_images(labels: Path, tmp_path: Path) -> None:
    survey = tmp_path / "survey" / "floor_1"
    survey.mkdir(parents=True)
    Image.new("L", (4, 3), 255).save(survey / "floorplan.png")
    (survey.parent / "floor_dimensions.csv").write_text("floor,width,height\n1,40,30\n", encoding="utf-8")
    exported(labels, tmp_path / "out", ExportContext(survey=survey.parent))
    session = open_labelled(labels).sessions[0]
    found = opened(tmp_path / "out" / f"{session.slug}.mcap")
    numbers = {floor.number for floor in open_labelled(labels).floors}
    shown = found.get("/plan_image/floor_1", [])
    assert len(shown) == (1 in numbers)
    for _, image in shown:
        assert base64.b64decode(image["data"]) == (survey / "floorplan.png").read_bytes()
    assert "/fix" not in found, "without a georeference nobody knows where on the earth"


def test_labels_without_a_position_are_refused(labels: Path, tmp_path: Path) -> None:
    shutil.copytree(labels, tmp_path / "labels")
    for file in (tmp_path / "labels" / "trajectory").iterdir():
        pl.read_parquet(file).with_columns(status=pl.lit("no_mapping")).write_parquet(file)
    with pytest.raises(DatasetError, match="none of its sessions has a position"):
        exported(tmp_path / "labels", tmp_path / "none")
