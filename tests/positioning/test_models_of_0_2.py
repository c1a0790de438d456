"""Model files of version 0.2: kept models say the same, removed ones are refused by name, everywhere in one way."""

from __future__ import annotations

import json
import re
import shutil
import subprocess
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from tests.cli.command import the_error, vislam2tag
from tests.positioning.in_an_app import APP
from vislam2tag.common.errors import ModelError, UsageError
from vislam2tag.pipeline.positioning.train import TrainPlan, train
from vislam2tag.positioning.model_files import load_model, save_model
from vislam2tag.positioning.radio_scans import RadioScans, scans_from_readings
from vislam2tag.positioning.registry import REMOVED, model_named, model_names, removed_model

FILES = Path(__file__).parents[1] / "data" / "outputs-0.2" / "models"
EXPECTED: dict[str, dict[str, list[Any]]] = json.loads((FILES / "positions.json").read_text())
NETWORKS = ("multi-cel", "regression-net")
NUMBERS = ("x", "y", "z", "radius_68_m", "radius_95_m")


def asked(name: str) -> Path:
    return FILES / ("scans-cell-density.json" if name == "cell-density" else "scans.json")


def scans_of(path: Path) -> RadioScans:
    scans = json.loads(path.read_text())["scans"]
    heard = [(row, *reading) for row, scan in enumerate(scans) for reading in scan["readings"].items()]
    rows, names, levels = (np.array(column) for column in zip(*heard, strict=True))
    session = np.array([scan["session"] for scan in scans])
    return scans_from_readings(rows, np.char.lower(names), levels, len(scans), session=session)


@pytest.mark.parametrize("name", EXPECTED)
def test_kept_models_say_what_they_said(name: str) -> None:
    if name in NETWORKS:
        pytest.importorskip("torch", reason="networks need the extra 'models'")
    expected = EXPECTED[name]
    saved = load_model(FILES / f"{name}.v2t")
    found = saved.model.predict(scans_of(asked(name)))
    assert saved.name == name
    assert found.known.tolist() == [floor is not None for floor in expected["floor"]]
    storeys = [found.storeys[at] for at in found.storey[found.known]]
    stated = zip(expected["building"], expected["floor"], strict=True)
    assert [tuple(storey) for storey in storeys] == [one for one in stated if one[1] is not None]
    values = (found.xy[:, 0], found.xy[:, 1], found.z, found.radius_68_m, found.radius_95_m)
    for number, value in zip(NUMBERS, values, strict=True):
        np.testing.assert_allclose(value, np.array(expected[number], dtype=np.float64), rtol=1e-6, err_msg=number)
    if expected["unlike"] is not None:
        np.testing.assert_array_equal(found.unlike, expected["unlike"])


def test_there_is_a_file_of_each_kind() -> None:
    assert {path.stem for path in FILES.glob("*.v2t")} == {*EXPECTED, *REMOVED}
    assert not set(REMOVED) & set(model_names())


@pytest.mark.parametrize("name", REMOVED)
def test_removed_models_are_refused_by_name(name: str, tmp_path: Path) -> None:
    path, removed = FILES / f"{name}.v2t", removed_model(name)
    assert removed == f"the model {name} was removed; {REMOVED[name]}"
    message = f"{path}: {removed}. The file cannot be opened; train a new model"
    with pytest.raises(UsageError, match=f"^{re.escape(removed)}$"):
        model_named(name)
    with pytest.raises(ModelError, match=f"^{re.escape(message)}$"):
        load_model(path)
    with pytest.raises(ModelError, match=f"^{re.escape(message)}$"):
        train(tmp_path, TrainPlan(None, {}, update=path), tmp_path / "later.v2t")


@pytest.mark.parametrize("command", [("--serve",), (FILES / "scans.json",)])
def test_locate_refuses_a_removed_model_before_anything_else(command: tuple[str | Path, ...]) -> None:
    message = the_error(vislam2tag("locate", FILES / "knn.v2t", *command))
    assert "knn.v2t: the model knn was removed; use weighted-knn. The file cannot be opened" in message


@pytest.mark.parametrize("name", REMOVED)
def test_the_app_refuses_a_removed_model_by_name(name: str) -> None:
    node = shutil.which("node")
    if node is None:
        pytest.skip("Node.js is not installed")
    ended = subprocess.run(
        [node, APP, FILES / f"{name}.v2t", FILES / "scans.json"], capture_output=True, text=True, check=False
    )
    assert ended.returncode != 0
    assert f"Error: {removed_model(name)}. Train a new file" in ended.stderr


def test_networks_beside_cell_density_were_removed(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    removed = "the parameter networks of cell-density was removed; use cell-density without it"
    with pytest.raises(UsageError, match=f"^{removed}$"):
        model_named("cell-density", networks=(1.7,))
    saved = load_model(FILES / "cell-density.v2t")
    monkeypatch.setattr(saved.model, "get_params", lambda: {"copies": 4, "networks": (1.7,), "seed": 0})
    save_model(saved, tmp_path / "model.v2t")
    with pytest.raises(ModelError, match=rf"model\.v2t: {removed}\. The file cannot be opened; train a new model$"):
        load_model(tmp_path / "model.v2t")
