"""Training scans and their places as named arrays, for models that keep them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from vislam2tag.core.arrays import AnyArray
from vislam2tag.positioning.places import Places, Storey
from vislam2tag.positioning.scans.radio_scans import RadioScans


def scan_arrays(scans: RadioScans) -> dict[str, AnyArray]:
    """Return what was heard; devices, sessions and times are not kept."""
    return {"start": scans.start, "column": scans.column.astype(np.int32), "rssi_dbm": scans.rssi_dbm}


def place_arrays(places: Places) -> dict[str, AnyArray]:
    """Return storeys, positions and heights; how sure the labels were is not kept."""
    return {"storey": places.storey.astype(np.int32), "xy": places.xy, "z": places.z}


def scans_kept(arrays: Mapping[str, AnyArray], access_points: Sequence[str]) -> RadioScans:
    """Take back what :func:`scan_arrays` gave."""
    n = len(arrays["start"]) - 1
    nowhere = np.full(n, "", dtype=np.str_)
    return RadioScans(
        access_points=tuple(access_points),
        start=arrays["start"],
        column=arrays["column"].astype(np.int64),
        rssi_dbm=arrays["rssi_dbm"],
        device=nowhere,
        session=nowhere,
        time_ns=np.zeros(n, dtype=np.int64),
    )


def places_kept(arrays: Mapping[str, AnyArray], storeys: tuple[Storey, ...]) -> Places:
    """Take back what :func:`place_arrays` gave."""
    return Places(
        storeys=storeys,
        storey=arrays["storey"].astype(np.int64),
        xy=arrays["xy"],
        z=arrays["z"],
        sigma_m=np.full(len(arrays["z"]), np.nan),
    )
