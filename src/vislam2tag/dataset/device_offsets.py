"""How much louder one phone hears than another, from access points that both heard at the same place.

Model: mean RSSI of a phone in a cell = what an access point has there + the phone's offset. The places are eliminated;
what remains is the Laplacian of the graph of phones that share places, whose least-squares solution of least norm has a
mean of zero in each of its connected parts.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np
import polars as pl
from scipy.sparse import csr_array

from vislam2tag.core.arrays import FloatArray, IntArray

CELL_M = 2.0
"""Side of a cell that counts as one place, metres: RSSI decorrelates over a few wavelengths, its mean over metres."""
_PLACE = ("technology", "building", "floor", "column", "row", "bssid")
_PARTS = 16
_SINGULAR = 1e-9
"""Share of the greatest singular value below which one is zero: sums over many places leave it above rounding."""


@dataclass
class PlaceMeans:
    """Sums of RSSI by place, access point and device; what is kept grows with the place, not with the walks."""

    _parts: list[pl.DataFrame] = field(default_factory=list)

    def add(self, readings: pl.DataFrame) -> None:
        """Add labelled readings: technology, building, floor, x, y, bssid, device, rssi_dbm."""
        cells = readings.with_columns(
            column=(pl.col("x") // CELL_M).cast(pl.Int32), row=(pl.col("y") // CELL_M).cast(pl.Int32)
        )
        sums = cells.group_by(*_PLACE, "device").agg(
            sum=pl.col("rssi_dbm").cast(pl.Float64).sum(), count=pl.len().cast(pl.Int64)
        )
        self._parts.append(sums)
        if len(self._parts) == _PARTS:
            self._parts = [self._merged()]

    def shared(self) -> pl.DataFrame:
        """Mean RSSI (``rssi_dbm``) of each device where at least two heard the same access point, in order."""
        if not self._parts:
            return pl.DataFrame(schema={"technology": pl.String, "device": pl.String, "rssi_dbm": pl.Float64})
        merged = self._merged().filter(pl.len().over(_PLACE) > 1)
        return merged.sort(*_PLACE, "device").with_columns(rssi_dbm=pl.col("sum") / pl.col("count"))

    def _merged(self) -> pl.DataFrame:
        return pl.concat(self._parts).group_by(*_PLACE, "device").agg(pl.col("sum", "count").sum())


@dataclass(frozen=True)
class DeviceOffset:
    """Offset of a device against the mean of those that share places with it, dB, and how many places it shares."""

    offset_db: float | None
    shared: int


def device_offsets(shared: pl.DataFrame, devices: Sequence[str]) -> dict[str, DeviceOffset]:
    """Solve for the offset of each device; ``shared`` as :meth:`PlaceMeans.shared` gives it, of one technology."""
    if not len(shared):
        return {device: DeviceOffset(None, 0) for device in devices}
    index = {device: number for number, device in enumerate(devices)}
    device = shared["device"].replace_strict(index, return_dtype=pl.Int64).to_numpy()
    place = shared.select(pl.struct(_PLACE).rank("dense")).to_series().cast(pl.Int64).to_numpy() - 1
    heard = np.zeros(len(devices), dtype=np.int64)
    np.add.at(heard, device, 1)
    several = np.bincount(place).astype(np.float64)
    level = np.bincount(place, weights=shared["rssi_dbm"].to_numpy()) / several
    right = np.bincount(device, weights=shared["rssi_dbm"].to_numpy() - level[place], minlength=len(devices))
    together = _pairs(place, device, 1 / several, len(devices))
    offset = np.linalg.lstsq(np.diag(heard.astype(np.float64)) - together, right, rcond=_SINGULAR)[0]
    return {
        name: DeviceOffset(round(float(offset[number]), 4) if heard[number] else None, int(heard[number]))
        for name, number in index.items()
    }


def _pairs(place: IntArray, device: IntArray, weight: FloatArray, devices: int) -> FloatArray:
    """Sum, over the places, of the weight of each pair of devices that both heard something there (d, d)."""
    heard = csr_array((np.ones(len(place)), (place, device)), shape=(len(weight), devices))
    return np.asarray(csr_array(heard.T @ (heard * weight[:, None])).toarray(), dtype=np.float64)
