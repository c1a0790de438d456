"""The regression network learns, and rounds its third number to a floor that there is."""

from __future__ import annotations

import numpy as np
import pytest

from tests.positioning.radio_fields import TWO_BUILDINGS, surveyed
from vislam2tag.positioning.registry import model_named

torch = pytest.importorskip("torch", reason="networks need the extra 'models'")

QUICK = {"backbone": (64,), "head": (64,), "epochs": 25, "learning_rate": 1e-2, "device": "cpu"}


def test_only_floors_that_were_taught_are_named() -> None:
    scans, places = surveyed(60, TWO_BUILDINGS)
    taught = np.isin(places.storey, [0, 3])
    model = model_named("regression-net", **{**QUICK, "epochs": 3}).fit(scans[taught], places[taught])
    found = model.predict(scans)
    assert set(found.storey[found.known]) <= {0, 3}
    assert (found.storey_probability[found.known][:, [1, 2]] == 0).all()
