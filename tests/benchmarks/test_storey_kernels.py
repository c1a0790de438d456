"""Storeys are told of scans that were left out, and better where wrong labels are."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from storey_kernels import CHOICES, right_share

from tests.positioning.radio_fields import surveyed
from vislam2tag.positioning.scans.held_out import folds
from vislam2tag.positioning.scans.learning_data import LearningData


def test_wrong_labels_cost_less_where_contradicted_scans_are_left_out() -> None:
    scans, places = surveyed(60, noise_db=6.0)
    wrong = np.isin(np.arange(60), [3, 20, 41])
    swapped = replace(places, storey=np.where(wrong, 1 - places.storey, places.storey))
    data = LearningData(np.arange(60).astype(np.str_), scans, swapped)
    shares = [
        right_share(data, CHOICES[name], lambda draw: folds(np.arange(60), 5, draw))
        for name in ("directions and steps", "directions and steps, contradicted scans left out")
    ]
    assert 0.8 < shares[0] <= shares[1] <= 0.95 + 1e-9  # three of sixty are wrong whatever is said
