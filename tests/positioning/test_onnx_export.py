"""What onnxruntime makes of the file is what the model says."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from tests.positioning.radio_fields import TWO_BUILDINGS, surveyed
from tests.positioning.test_registry import Mean
from vislam2tag.common.errors import OutputError, UsageError
from vislam2tag.positioning import onnx_export
from vislam2tag.positioning.onnx_export import INPUT, write_onnx
from vislam2tag.positioning.radio_scans import RadioScans, scans_from_readings
from vislam2tag.positioning.registry import Positioner, model_named

FAR_M = np.array([-7600.0, 4864900.0])
"""Places as in UJIIndoorLoc, where single precision is half a metre."""


def fitted(name: str, **widths: Any) -> Positioner:
    pytest.importorskip("torch", reason="networks need the extra 'models'")
    scans, places = surveyed(60, TWO_BUILDINGS)
    places.xy[:] += FAR_M
    brief = {} if name.startswith("cell-density") else {"epochs": 3, "device": "cpu"}
    return model_named(name, **brief, **widths).fit(scans, places)


def fresh_scans() -> RadioScans:
    """New scans, one of which hears nothing."""
    scans, _ = surveyed(40, TWO_BUILDINGS, seed=4)
    heard = np.array([name not in ("ap03",) for name in scans.access_points])[scans.column] & (scans.row != 5)
    names = np.array(scans.access_points)[scans.column[heard]]
    return scans_from_readings(scans.row[heard], names, scans.rssi_dbm[heard], 40)


@pytest.mark.parametrize(
    ("name", "widths"),
    [
        ("multi-cel", {"backbone": (16,), "heads": (8,)}),
        ("regression-net", {"backbone": (16,), "head": (8,)}),
        ("cell-density", {}),
    ],
)
def test_onnxruntime_agrees(name: str, widths: dict[str, Any], tmp_path: Path) -> None:
    onnxruntime = pytest.importorskip("onnxruntime", reason="is not installed")
    model = fitted(name, **widths)
    write_onnx(model, tmp_path / "model.onnx", {"frame": "here"})
    session = onnxruntime.InferenceSession(tmp_path / "model.onnx")
    about = session.get_modelmeta().custom_metadata_map
    assert json.loads(about["access_points"]) == list(model.access_points_)
    assert json.loads(about["storeys"])[2] == {"building": "B", "floor": -1}
    assert about["frame"] == "here"
    for rows in (slice(None), slice(0, 1), slice(5, 6)):
        scans = fresh_scans()[rows]
        found = model.predict(scans)
        outputs = [output.name for output in session.get_outputs()]
        answer = dict(zip(outputs, session.run(None, {INPUT: scans.over(model.access_points_).dense()}), strict=True))
        np.testing.assert_array_equal(answer.pop("storey"), found.storey)
        assert set(answer) == {"xy", "z", "storey_probability", "radius_68_m", "radius_95_m"}
        for field, values in answer.items():
            np.testing.assert_allclose(values, getattr(found, field), atol=1e-5, rtol=1e-7, err_msg=field)
    assert fresh_scans().heard[5] == 0
    assert not found.known.any()


def test_the_same_model_gives_the_same_bytes_and_no_paths(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    onnx = pytest.importorskip("onnx", reason="is not installed")
    model = fitted("regression-net", backbone=(8,), head=(8,))
    for name in ("one", "two"):
        write_onnx(model, tmp_path / name)
    written = (tmp_path / "one").read_bytes()
    assert written == (tmp_path / "two").read_bytes()
    assert b".py" not in written
    assert sorted(path.name for path in tmp_path.iterdir()) == ["one", "two"]
    monkeypatch.setattr(onnx_export, "_graph", lambda *_: onnx.load(tmp_path / "one"))  # exporting takes seconds
    with pytest.raises(OutputError, match="cannot be written"):
        write_onnx(model, tmp_path / "no folder" / "model.onnx")


def test_models_that_are_no_module_are_not_exported(tmp_path: Path) -> None:
    with pytest.raises(UsageError, match="Mean is not exported to ONNX"):
        write_onnx(Mean(), tmp_path / "model.onnx")
