"""Values that cannot be are refused before anything is trained."""

from __future__ import annotations

from typing import Any

import pytest

from tests.positioning.radio_fields import surveyed
from vislam2tag.common.errors import UsageError
from vislam2tag.positioning.registry import model_named

pytest.importorskip("torch", reason="networks need the extra 'models'")


@pytest.mark.parametrize(
    ("parameter", "value", "message"),
    [
        ("epochs", 0, "epochs 0: expected 1 or more"),
        ("learning_rate", 2.0, "learning_rate 2.0: expected 1e-09 to 1"),
        ("dropout", 1.0, "dropout 1.0: expected 0 to 0.95"),
        ("cell_m", 0, "cell_m 0: expected 0.1 to 10000"),
        ("heads", [512, 0], "heads .512, 0.: expected the widths"),
        ("input_scale", "loud", "input_scale 'loud': expected one of min-max, powed"),
        ("device", "abacus", "device 'abacus' is not there"),
    ],
)
def test_what_cannot_be_is_refused(parameter: str, value: Any, message: str) -> None:
    with pytest.raises(UsageError, match=message):
        model_named("multi-cel", **{"device": "cpu", parameter: value}).fit(*surveyed(4))


def test_no_hidden_layer_is_a_linear_model() -> None:
    scans, places = surveyed(12)
    for name, head in (("multi-cel", "heads"), ("regression-net", "head")):
        model = model_named(name, **{"backbone": [], head: [], "epochs": 2, "device": "cpu"})
        assert model.fit(scans, places).predict(scans).known.all()
