"""Models as files: the same answers after loading, the same bytes for the same model, one clear message otherwise."""

from __future__ import annotations

import json
import stat
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from safetensors import safe_open
from safetensors.numpy import save_file

from tests.positioning.radio_world import radio_world
from vislam2tag.common.errors import ModelError, OutputError, UsageError
from vislam2tag.positioning import registry as base
from vislam2tag.positioning.model_file import ModelOrigin, SavedModel, load_model, save_model
from vislam2tag.positioning.models.weighted_knn import NearestNeighbours
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
    with pytest.raises(ModelError, match=r"model\.v2t: is no model, or damaged"):
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
    with pytest.raises(ModelError, match="is no model, or damaged"):
        load_model(tmp_path / "text.v2t")
    save_file({"weight": np.zeros(3)}, tmp_path / "other.v2t")
    with pytest.raises(ModelError, match="is of another program"):
        load_model(tmp_path / "other.v2t")
    for path in (tmp_path / "absent.v2t", tmp_path):
        with pytest.raises(ModelError, match=r"cannot be read|is no model"):
            load_model(path)


def test_later_and_altered_headers_are_told(tmp_path: Path) -> None:
    path = saved(tmp_path / "model.v2t")
    rewritten(path, lambda header: header.update(format_version=2))
    with pytest.raises(ModelError, match="has format version 2, this program reads up to 1; update"):
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
    with pytest.raises(ModelError, match="which has no model 'psychic'; update"):
        load_model(path)
    save_model(SavedModel("weighted-knn", model, ORIGIN), path)
    with pytest.raises(ModelError, match="which has no parameter hue of weighted-knn"):
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
