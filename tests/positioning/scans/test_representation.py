"""Representations keep the order of levels and end at 0 and 1."""

from __future__ import annotations

import numpy as np
import pytest

from tests.positioning.scans.test_radio_scans import scans_from
from vislam2tag.positioning.scans.representation import Representation, represented


@pytest.mark.parametrize("representation", Representation)
def test_louder_is_more_and_not_heard_is_nothing(representation: Representation) -> None:
    levels = np.array([[np.nan, -104.0, -90.0, -60.0, -30.0, 0.0]])
    numbers = represented(scans_from(levels), representation)[0]
    assert numbers[0] == 0
    assert (np.diff(numbers) > 0).all()
    assert numbers[-1] == pytest.approx(1.0)


def test_strong_levels_count_more_when_powed() -> None:
    levels = scans_from(np.array([[-90.0, -80.0, -50.0, -40.0, np.nan, np.nan]]))
    positive, powed = (represented(levels, kind)[0] for kind in (Representation.POSITIVE, Representation.POWED))
    assert positive[1] - positive[0] == pytest.approx(positive[3] - positive[2])
    assert powed[3] - powed[2] > 2 * (powed[1] - powed[0])
