"""Which training scans may speak for others when a model tells how well it does: never those of the same walk."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from vislam2tag.core.arrays import BoolArray, IntArray
from vislam2tag.positioning.scans.places import LabelledScans, ScanPlaces
from vislam2tag.positioning.scans.radio_scans import RadioScans

CALIBRATED_WITH = 2000
"""Most scans that are left out in turn: more would not make radii truer."""


def calibration_rows(count: int, most: int = CALIBRATED_WITH) -> IntArray:
    """Return which of so many scans calibrate: (k,), evenly spread, in order; of a lone scan none, to learn from it."""
    return np.unique(np.linspace(0, count - 1, most if count > 1 else 0).astype(np.int64))


def walk_numbers(scans: RadioScans, places: ScanPlaces) -> IntArray:
    """Number the walks (n,): scans of one are not independent, so that they are left out together.

    Those of :func:`lone_walks` count as walks of one scan.
    """
    names, session = np.unique(scans.session, return_inverse=True)
    return np.where(lone_walks(scans, places), len(names) + np.arange(len(scans)), session)


def lone_walks(scans: RadioScans, places: ScanPlaces) -> BoolArray:
    """Which scans (n,) have no session, or one that is alone on one of its storeys.

    Left out, nothing would be known of that storey.
    """
    names, session = np.unique(scans.session, return_inverse=True)
    visited = np.zeros((len(names), len(places.storeys)), dtype=np.bool_)
    visited[session, places.storey] = True
    alone = (visited & (visited.sum(axis=0) == 1)).any(axis=1)
    return np.asarray((scans.session == "") | alone[session])


def area_numbers(places: ScanPlaces, side_m: float) -> IntArray:
    """Number the squares (n,) that places lie in, whatever the storey."""
    at = np.floor(places.xy / side_m).astype(np.int64)
    return np.unique(at, axis=0, return_inverse=True)[1].reshape(-1)


def folds(walks: IntArray, count: int, seed: int) -> Iterator[tuple[BoolArray, BoolArray]]:
    """Deal walks (n,) or areas to at most ``count`` folds; yield masks of what trains and what is held out.

    Nothing comes where there is but one walk.
    """
    fold = fold_numbers(walks, count, seed)
    for number in range(fold.max(initial=-1) + 1):
        held_out = fold == number
        if not held_out.all():
            yield ~held_out, held_out


def fold_numbers(walks: IntArray, count: int, seed: int) -> IntArray:
    """Deal walks (n,) or areas to at most ``count`` folds: (n,) which each scan is in."""
    numbers, walk = np.unique(walks, return_inverse=True)
    return np.asarray((np.random.default_rng(seed).permutation(len(numbers)) % count)[walk])


def usable_validation(validation: LabelledScans | None) -> LabelledScans | None:
    """Return the held-out scans that hear something and have a place; None where there are none."""
    if validation is None:
        return None
    scans, places = validation
    good = (scans.heard > 0) & np.isfinite(places.xy).all(axis=1) & (places.storey >= 0)
    return (scans[good], places[good]) if good.any() else None
