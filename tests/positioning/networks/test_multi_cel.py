"""multi-CEL learns, and says what the paper's decoding says."""

from __future__ import annotations

import numpy as np
import pytest

from tests.positioning.radio_fields import surveyed
from vislam2tag.positioning.networks.overlapping_cells import lattice_over
from vislam2tag.positioning.registry import model_named

torch = pytest.importorskip("torch", reason="networks need the extra 'models'")

QUICK = {"backbone": (64,), "heads": (64,), "epochs": 25, "learning_rate": 1e-2, "device": "cpu"}


def test_answers_are_the_best_cells_codes() -> None:
    scans, places = surveyed(60)
    model = model_named("multi-cel", **{**QUICK, "epochs": 2}).fit(scans, places)
    found = model.predict(scans)
    locator = model.locator_
    lattice = lattice_over(places, 10.0, 0.3)
    with torch.no_grad():
        logits, codes = (part.numpy() for part in locator.network(locator.scaling(torch.from_numpy(scans.dense()))))
    best = logits.argmax(axis=1)
    expected = lattice.centre_m[best] + 8.0 * codes[np.arange(60), best]
    np.testing.assert_allclose(found.xy, expected, atol=1e-9)
    np.testing.assert_array_equal(found.storey, lattice.storey[best])
    np.testing.assert_allclose(found.storey_probability.sum(axis=1), 1.0)
    np.testing.assert_allclose(found.z, 4.0 * found.floor + 1.0)


def test_the_loss_is_cross_entropy_of_weights_plus_squared_code_errors() -> None:
    scans, places = surveyed(2)
    model = model_named("multi-cel", **{**QUICK, "epochs": 1, "class_weight": 2.0, "code_weight": 3.0}).fit(
        scans, places
    )
    locator = model.locator_
    cell, weight, code = (
        torch.tensor([[0, 1, 0]]),
        torch.tensor([[0.8, 0.2, 0.0]]).double(),
        torch.zeros(1, 3, 2).double(),
    )
    inputs = locator.scaling(torch.from_numpy(scans[:1].dense()))
    with torch.no_grad():
        logits, codes = locator.network(inputs)
        log_share = torch.log_softmax(logits, dim=1)[0]
        expected = 2.0 * -(0.8 * log_share[0] + 0.2 * log_share[1]) + 3.0 * codes[0, :2].square().sum()
        loss = locator.losses(inputs, cell, weight, code)
    assert loss.tolist() == pytest.approx([float(expected)])
