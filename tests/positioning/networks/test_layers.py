"""Inputs lie between 0 and 1, and 0 is not heard."""

from __future__ import annotations

import numpy as np
import pytest

from tests.positioning.test_radio_scans import scans_from
from vislam2tag.positioning.radio_scans import Representation, represented

torch = pytest.importorskip("torch", reason="networks need the extra 'models'")
from vislam2tag.positioning.networks.layers import InputScale, LevelScaling, dense  # noqa: E402

LEVELS = np.array([[np.nan, -110.0, -80.0, -50.0, -30.0, 5.0]])


def scaled(scale: InputScale, strongest_dbm: float) -> np.ndarray:
    module = LevelScaling()
    module.fit(scans_from(np.array([[strongest_dbm, -90.0, np.nan, np.nan, np.nan, np.nan]])), scale)
    return np.asarray(module(torch.from_numpy(LEVELS)).numpy()[0])


def test_min_max_ends_at_the_strongest_level_of_training() -> None:
    np.testing.assert_allclose(scaled(InputScale.MIN_MAX, -50.0), [0, 0, 0.5, 1, 1, 1])


def test_powed_is_the_powed_representation() -> None:
    expected = represented(scans_from(np.minimum(LEVELS, 0.0)), Representation.POWED)[0]
    np.testing.assert_allclose(scaled(InputScale.POWED, -50.0), expected)


def test_levels_that_are_all_as_faint_as_not_heard_divide_by_nothing() -> None:
    assert np.isfinite(scaled(InputScale.MIN_MAX, -120.0)).all()


def test_dense_layers_have_the_widths_asked_for() -> None:
    network = dense(3, (8, 4), 0.5).eval()
    assert network(torch.rand(2, 3)).shape == (2, 4)
    assert len(network) == 6
    assert dense(3, (), 0.5)(torch.ones(1, 3)).tolist() == [[1, 1, 1]]
