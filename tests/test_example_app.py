"""The program that an app embeds reads a model's file and says what the model says, without Python."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from tests.positioning.in_an_app import answered, assert_same
from tests.positioning.radio_world import radio_world
from vislam2tag.positioning.model_files import ModelOrigin, SavedModel, save_model
from vislam2tag.positioning.radio_scans import RadioScans
from vislam2tag.positioning.registry import model_named, model_names

NETWORKS = ("multi-cel", "regression-net")
NAMES = tuple(name for name in model_names() if not name.startswith("example-"))
SETTINGS: dict[str, list[dict[str, Any]]] = {
    "multi-cel": [{"epochs": 3, "backbone": (16,), "heads": (8,), "device": "cpu"}],
    "regression-net": [{"epochs": 3, "backbone": (16, 8), "head": (), "device": "cpu"}],
    "weighted-knn": [{}, {"distance": "euclidean", "representation": "exponential"}, {"distance": "cosine", "k": 999}],
}
KINDS = [(name, settings) for name in NAMES for settings in SETTINGS.get(name, [{}])]


def scans_asked() -> RadioScans:
    """Of two walks and of none; one hears nothing, one nothing like what was learned."""
    scans, _ = radio_world(seed=7, walks=2, offset_db=-2.0)
    session = np.where(np.arange(len(scans)) % 5 == 0, "", scans.session)
    level = np.where(scans.row == 4, -30.0, scans.rssi_dbm)
    scans = RadioScans(scans.access_points, scans.start, scans.column, level, scans.device, session, scans.time_ns)
    return scans.only(scans.row != 3)


@pytest.mark.parametrize(("name", "settings"), KINDS, ids=lambda value: value if isinstance(value, str) else "")
def test_the_app_says_what_the_model_says(name: str, settings: dict[str, Any], tmp_path: Path) -> None:
    if name in NETWORKS:
        pytest.importorskip("torch", reason="networks need the extra 'models'")
    model = model_named(name, **settings).fit(*radio_world(seed=1))
    save_model(SavedModel(name, model, ModelOrigin(dataset="world", scans=1)), tmp_path / "model.v2t")
    scans = scans_asked()
    found = model.predict(scans)
    assert 0 < found.known.sum() < len(found)
    assert_same(answered(tmp_path / "model.v2t", scans), found)
