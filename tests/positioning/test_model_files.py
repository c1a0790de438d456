"""Models as files: the same answers after loading, the same bytes for the same model, one clear message otherwise.

What onnxruntime makes of the file is what the model says.
"""

from __future__ import annotations

import json
import stat
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from safetensors import safe_open
from safetensors.numpy import save_file

from tests.positioning.radio_fields import TWO_BUILDINGS, surveyed
from tests.positioning.radio_world import radio_world
from tests.positioning.test_registry import Mean
from vislam2tag.common.errors import ModelError, OutputError, UsageError
from vislam2tag.positioning import model_files
from vislam2tag.positioning import registry as base
from vislam2tag.positioning.model_files import INPUT, ModelOrigin, SavedModel, load_model, save_model, write_onnx
from vislam2tag.positioning.models.weighted_knn import NearestNeighbours
from vislam2tag.positioning.radio_scans import RadioScans, scans_from_readings
from vislam2tag.positioning.registry import Positioner, model_named, model_names

ORIGIN = ModelOrigin(dataset="small", part="random, fold random", scans=36, bssid_key="0123456789abcdef")
KEY = "vislam2tag_model"
SMALL: dict[str, dict[str, object]] = {
    "weighted-knn": {"k": 3, "distance": "cosine"},
    "multi-cel": {"epochs": 1, "backbone": (4,), "heads": (4,), "device": "cpu"},
    "regression-net": {"epochs": 1, "backbone": (4,), "head": (4,), "device": "cpu"},
    "cell-density": {"copies": 1},
}
"""Parameters that make models quick; others are tried with their own."""
OF_TORCH = ("multi-cel", "regression-net")


def fitted(name: str = "weighted-knn") -> SavedModel:
    model = model_named(name, **SMALL.get(name, {}))
    return SavedModel(name, model.fit(*radio_world(walks=1)), ORIGIN)


def saved(path: Path) -> Path:
    save_model(fitted(), path)
    return path


@pytest.mark.parametrize("name", model_names())
def test_a_loaded_model_answers_the_same(name: str, tmp_path: Path) -> None:
    if name in OF_TORCH:
        pytest.importorskip("torch", reason="networks need the extra 'models'")
    first = fitted(name)
    save_model(first, tmp_path / "model.v2t")
    again = load_model(tmp_path / "model.v2t")
    assert (again.name, again.origin) == (name, ORIGIN)
    assert again.model.get_params() == first.model.get_params()
    assert again.model.access_points_ == first.model.access_points_
    assert again.model.storeys_ == first.model.storeys_
    scans, _ = radio_world(seed=5, walks=1)
    one, other = first.model.predict(scans), again.model.predict(scans)
    for field in ("storey", "xy", "z", "storey_probability", "radius_68_m", "radius_95_m", "unlike"):
        np.testing.assert_array_equal(getattr(one, field), getattr(other, field))
    save_model(again, tmp_path / "again.v2t")
    save_model(fitted(name), tmp_path / "anew.v2t")
    whole = (tmp_path / "model.v2t").read_bytes()
    assert (tmp_path / "again.v2t").read_bytes() == whole
    assert (tmp_path / "anew.v2t").read_bytes() == whole


def rewritten(path: Path, change: Callable[[dict[str, object]], object]) -> None:
    """Change the header of a model's file and leave the rest."""
    with safe_open(path, framework="numpy") as file:
        header = json.loads(file.metadata()[KEY])
        arrays = {name: file.get_tensor(name) for name in file.keys()}  # noqa: SIM118
    change(header)
    save_file(arrays, path, {KEY: json.dumps(header)})


@pytest.mark.parametrize("share", [0.0, 0.001, 0.1, 0.5, 0.999])
def test_cut_files_are_told(share: float, tmp_path: Path) -> None:
    path = saved(tmp_path / "model.v2t")
    whole = path.read_bytes()
    path.write_bytes(whole[: int(share * len(whole))])
    with pytest.raises(ModelError, match=r"model\.v2t: not a model file, or damaged"):
        load_model(path)


def test_any_changed_byte_is_told(tmp_path: Path) -> None:
    path = saved(tmp_path / "model.v2t")
    whole = path.read_bytes()
    for place in np.linspace(0, len(whole) - 1, 60).astype(int):
        broken = bytearray(whole)
        broken[place] ^= 0x01
        path.write_bytes(broken)
        with pytest.raises(ModelError, match=r"model\.v2t: "):
            load_model(path)


def test_foreign_files_are_told(tmp_path: Path) -> None:
    (tmp_path / "text.v2t").write_text("scan_id,bssid,rssi_dbm\n")
    with pytest.raises(ModelError, match="not a model file, or damaged"):
        load_model(tmp_path / "text.v2t")
    save_file({"weight": np.zeros(3)}, tmp_path / "other.v2t")
    with pytest.raises(ModelError, match="a model file of another program"):
        load_model(tmp_path / "other.v2t")
    for path in (tmp_path / "absent.v2t", tmp_path):
        with pytest.raises(ModelError, match=r"not a regular file|cannot be read|not a model file"):
            load_model(path)


def test_later_and_altered_headers_are_told(tmp_path: Path) -> None:
    path = saved(tmp_path / "model.v2t")
    rewritten(path, lambda header: header.update(format_version=2))
    with pytest.raises(ModelError, match="has format version 2, but this program reads up to 1; update"):
        load_model(path)
    rewritten(saved(path), lambda header: header.update(parameters={"k": 4}))
    with pytest.raises(ModelError, match="checksum does not match"):
        load_model(path)
    rewritten(saved(path), lambda header: header.pop("storeys"))
    with pytest.raises(ModelError, match="is damaged"):
        load_model(path)


class Renamed(NearestNeighbours):
    """A model whose saved arrays no version has ever written."""

    def __init__(self, *, k: int = 5, hue: str = "green") -> None:
        super().__init__(k=k)
        self.hue = hue

    def arrays(self) -> base.NamedArrays:
        return {"other": np.zeros(3)}


def test_models_of_another_version_are_told(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path = tmp_path / "model.v2t"
    model = Renamed().fit(*radio_world(walks=1))
    save_model(SavedModel("psychic", model, ORIGIN), path)
    with pytest.raises(ModelError, match="without model 'psychic'; update"):
        load_model(path)
    save_model(SavedModel("weighted-knn", model, ORIGIN), path)
    with pytest.raises(ModelError, match="without parameter hue of weighted-knn"):
        load_model(path)
    monkeypatch.setitem(base.MODELS._items, "renamed", Renamed)
    save_model(SavedModel("renamed", model, ORIGIN), path)
    with pytest.raises(ModelError, match="cannot use"):
        load_model(path)


def test_what_is_not_installed_is_told_as_that(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def lacking() -> Positioner:
        raise UsageError("torch is not installed")

    path = saved(tmp_path / "model.v2t")
    monkeypatch.setitem(base.MODELS._items, "weighted-knn", lacking)
    with pytest.raises(UsageError, match="torch is not installed"):
        load_model(path)


def test_a_place_that_cannot_be_written_is_told(tmp_path: Path) -> None:
    with pytest.raises(OutputError, match="cannot be written"):
        save_model(fitted(), tmp_path / "absent" / "model.v2t")
    (tmp_path / "folder").mkdir()
    with pytest.raises(OutputError, match="cannot be written"):
        save_model(fitted(), tmp_path / "folder")
    assert [path.name for path in tmp_path.iterdir()] == ["folder"]
    assert stat.S_IMODE(saved(tmp_path / "model.v2t").stat().st_mode) & 0o444


FAR_M = np.array([-7600.0, 4864900.0])
"""Places as in UJIIndoorLoc, where single precision is half a metre."""


def fitted_on_two_buildings(name: str, **widths: Any) -> Positioner:
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
    model = fitted_on_two_buildings(name, **widths)
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
    model = fitted_on_two_buildings("regression-net", backbone=(8,), head=(8,))
    for name in ("one", "two"):
        write_onnx(model, tmp_path / name)
    written = (tmp_path / "one").read_bytes()
    assert written == (tmp_path / "two").read_bytes()
    assert b".py" not in written
    assert sorted(path.name for path in tmp_path.iterdir()) == ["one", "two"]
    monkeypatch.setattr(model_files, "_graph", lambda *_: onnx.load(tmp_path / "one"))  # exporting takes seconds
    with pytest.raises(OutputError, match="cannot be written"):
        write_onnx(model, tmp_path / "no folder" / "model.onnx")


def test_models_that_are_no_module_are_not_exported(tmp_path: Path) -> None:
    with pytest.raises(UsageError, match="Mean cannot be exported to ONNX"):
        write_onnx(Mean(), tmp_path / "model.onnx")
