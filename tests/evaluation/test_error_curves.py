from __future__ import annotations

import numpy as np
import pytest

from tests.evaluation.test_pooling import walk
from vislam2tag.evaluation.error_curves import error_curve


def test_the_curve_ends_at_the_share_labelled() -> None:
    curve = error_curve([walk(np.array([0.1, 0.2, np.nan, np.nan])), walk(np.array([3.0, 0.3]))])
    assert curve is not None
    assert curve.share[-1] == pytest.approx(4 / 6)
    assert curve.share[0] == 0
    assert np.interp(1.0, curve.error_m, curve.share) == pytest.approx(3 / 6)
    assert curve.low is None


def test_the_band_holds_the_curve() -> None:
    rng = np.random.default_rng(2)
    curve = error_curve([walk(rng.gamma(2.0, scale, 50)) for scale in rng.uniform(0.1, 1.0, 12)])
    assert curve is not None
    assert curve.low is not None
    assert curve.high is not None
    assert (curve.low <= curve.share + 1e-12).all()
    assert (curve.share <= curve.high + 1e-12).all()
    assert (curve.high - curve.low).max() > 0.1
    assert (np.diff(curve.low) >= -1e-12).all()


def test_without_any_label_there_is_no_curve() -> None:
    assert error_curve([walk(np.array([np.nan]))]) is None
