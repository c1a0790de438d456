"""Which share of the scans at a place hears an access point: kernel regression over all scans of a floor.

Not heard is neither a weak reading nor a missing one: it is the other outcome of a scan, so it has a map of its own,
which makes the map of the mean one of the readings that *are* heard.
"""

from __future__ import annotations

import numpy as np
from scipy.sparse import csr_array
from scipy.spatial import cKDTree

from vislam2tag.core.arrays import FloatArray, IntArray

WIDTHS_M = (1.0, 1.5, 2.0, 3.0, 4.0)
"""Widths of the kernel (one standard deviation) that are tried, metres."""
_REACH = 3.0
"""Scans farther than this many widths do not count."""
_PRIOR_SCANS = 0.5
"""How many scans the share of the whole floor counts as."""
_SAMPLE_SCANS = 1500
"""Scans at which widths are compared."""


def heard_share(
    position: FloatArray, scan_position: FloatArray, heard: csr_array, floor_share: FloatArray, width_m: float
) -> FloatArray:
    """Share of scans (n, a), 0 to 1, that hear each access point at positions (n, 2).

    ``heard`` (s, a) is 1 where a scan heard it; ``floor_share`` (a,) is what holds where no scan is near.
    """
    return _share(_weights(position, scan_position, width_m), heard, floor_share)


def heard_matrix(scan: IntArray, access_point: IntArray, scans: int, access_points: int) -> csr_array:
    """Make (s, a) with 1 where a scan heard an access point, of the scan and access point of each reading (k,)."""
    matrix = csr_array((np.ones(len(scan)), (scan, access_point)), shape=(scans, access_points))
    matrix.sum_duplicates()
    matrix.data[:] = 1.0
    return matrix


def best_width(scan_position: FloatArray, fold: IntArray, heard: csr_array) -> float:
    """Find the width (m) that predicts best what scans (s,) hear, by :func:`heard_error` over all access points."""
    return min(WIDTHS_M, key=lambda width: float(heard_error(scan_position, fold, heard, width).mean()))


def heard_error(scan_position: FloatArray, fold: IntArray, heard: csr_array, width_m: float) -> FloatArray:
    """Mean squared error (a,) of the share that the scans of other folds predict for a scan (Brier 1950)."""
    sample = np.arange(0, len(fold), -(-len(fold) // _SAMPLE_SCANS))
    weights = _weights(scan_position[sample], scan_position, width_m)
    own = np.repeat(sample, np.diff(weights.indptr))
    weights.data[fold[own] == fold[weights.indices]] = 0.0
    share = _share(weights, heard, np.asarray(heard.mean(axis=0)))
    error: FloatArray = ((share - heard[sample].toarray()) ** 2).mean(axis=0)
    return error


def _share(weights: csr_array, heard: csr_array, floor_share: FloatArray) -> FloatArray:
    """Shares (n, a) by the weights (n, s) of scans, drawn to the floor's (a,)."""
    total = np.asarray(weights.sum(axis=1))[:, None]
    share: FloatArray = ((weights @ heard).toarray() + _PRIOR_SCANS * floor_share) / (total + _PRIOR_SCANS)
    return share


def _weights(position: FloatArray, scan_position: FloatArray, width_m: float) -> csr_array:
    """Gaussian weight (n, s) of each scan near each position."""
    near = cKDTree(position).sparse_distance_matrix(cKDTree(scan_position), _REACH * width_m, output_type="ndarray")
    # A pair that coincides is no explicit entry of some output types, but is of this one.
    weight = np.exp(-0.5 * (near["v"] / width_m) ** 2)
    return csr_array((weight, (near["i"], near["j"])), shape=(len(position), len(scan_position)))
