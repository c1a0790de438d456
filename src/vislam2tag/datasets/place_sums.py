"""Signal strength of access points at places: offsets between devices, and sums for the comparison of two surveys.

Offsets of devices: the mean RSSI of a phone in a cell is a value of the access point there plus the phone's offset.
Eliminating the places leaves the Laplacian of the graph of phones that share places. Its least-squares solution with
the smallest norm has a mean of zero in each connected part.

Sums without these offsets: strength counts from the faintest level that every phone of both surveys can hear, and is
zero if a scan did not hear the access point. "Not heard" thus has a value, and more sensitive phones do not hear more.
Each walk counts once at a place, with its mean, because its scans there share the path, the way the phone was held, and
the time of day.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np
import polars as pl
from scipy.sparse import csr_array

from vislam2tag.core.arrays import FloatArray, IntArray
from vislam2tag.core.robust import StoppingRule, iterate
from vislam2tag.datasets.model import Dataset, RunningTotal, each_session

CELL_M = 2.0
"""Side of a cell that counts as one place, metres: RSSI decorrelates over a few wavelengths, its mean over metres."""
_OFFSET_PLACE = ("technology", "building", "floor", "column", "row", "bssid")
_PARTS = 16
_SINGULAR = 1e-9
"""Share of the largest singular value below which one is zero; sums over many places leave it above rounding."""


def _offset_sums() -> RunningTotal:
    schema = {
        **dict.fromkeys(("technology", "building", "bssid", "device"), pl.String()),
        **dict.fromkeys(("floor", "column", "row"), pl.Int32()),
        "sum": pl.Float64(),
        "count": pl.Int64(),
    }
    return RunningTotal((*_OFFSET_PLACE, "device"), (pl.col("sum", "count").sum(),), schema)


@dataclass
class PlaceMeans:
    """Sums of RSSI by place, access point and device."""

    _sums: RunningTotal = field(default_factory=_offset_sums)

    def add(self, readings: pl.DataFrame) -> None:
        """Add labelled readings: technology, building, floor, x, y, bssid, device, rssi_dbm."""
        cells = readings.with_columns(
            column=(pl.col("x") // CELL_M).cast(pl.Int32), row=(pl.col("y") // CELL_M).cast(pl.Int32)
        )
        sums = cells.group_by(*_OFFSET_PLACE, "device").agg(
            sum=pl.col("rssi_dbm").cast(pl.Float64).sum(), count=pl.len().cast(pl.Int64)
        )
        self._sums.add(sums)

    def shared(self) -> pl.DataFrame:
        """Mean RSSI (``rssi_dbm``) of each device at places where at least two heard the same access point, in
        order."""
        merged = self._sums.table.filter(pl.len().over(_OFFSET_PLACE) > 1)
        return merged.sort(*_OFFSET_PLACE, "device").with_columns(rssi_dbm=pl.col("sum") / pl.col("count"))


def device_offsets(shared: pl.DataFrame, devices: Sequence[str]) -> dict[str, tuple[float | None, int]]:
    """Solve for each device's offset against the mean of those that share places with it, dB, and count these places.

    ``shared`` is the result of :meth:`PlaceMeans.shared` for one technology.
    """
    if not len(shared):
        return dict.fromkeys(devices, (None, 0))
    index = {device: number for number, device in enumerate(devices)}
    device = shared["device"].replace_strict(index, return_dtype=pl.Int64).to_numpy()
    place = shared.select(pl.struct(_OFFSET_PLACE).rank("dense")).to_series().cast(pl.Int64).to_numpy() - 1
    heard = np.zeros(len(devices), dtype=np.int64)
    np.add.at(heard, device, 1)
    several = np.bincount(place).astype(np.float64)
    level = np.bincount(place, weights=shared["rssi_dbm"].to_numpy()) / several
    right = np.bincount(device, weights=shared["rssi_dbm"].to_numpy() - level[place], minlength=len(devices))
    together = _pairs(place, device, 1 / several, len(devices))
    offset = np.linalg.lstsq(np.diag(heard.astype(np.float64)) - together, right, rcond=_SINGULAR)[0]
    return {
        name: (round(float(offset[number]), 4) if heard[number] else None, int(heard[number]))
        for name, number in index.items()
    }


def _pairs(place: IntArray, device: IntArray, weight: FloatArray, devices: int) -> FloatArray:
    """Sum, over the places, of the weight of each pair of devices that both heard something there (d, d)."""
    heard = csr_array((np.ones(len(place)), (place, device)), shape=(len(weight), devices))
    return np.asarray(csr_array(heard.T @ (heard * weight[:, None])).toarray(), dtype=np.float64)


PLACE = ("building", "floor", "column", "row")
BASE, LATER = "base", "later"
SURVEYS = (BASE, LATER)
LEAST_READINGS = 100
"""A device with fewer readings does not show what it cannot hear."""
_FAINTEST_DBM = -90.0
"""Assumed faintest level if no phone has enough readings."""
_OUTLIER_DB = 10.0
"""Devices with a larger difference at a place heard different transmitters."""
_MOST_ROUNDS = 20
"""Rounds of removing outliers and solving; two surveys of one building need three."""
_SMALL_DB = 5e-5
"""Convergence limit of offsets; they are rounded to twice as much."""
_UNKNOWN = "unknown"
_TYPES: Mapping[str, pl.DataType] = {
    **dict.fromkeys(("building", "bssid"), pl.String()),
    **dict.fromkeys(("floor", "column", "row"), pl.Int32()),
    **dict.fromkeys(("sum", "squares", "within"), pl.Float64()),
}
_VISITS, _SUMS = ("scans", "walks"), ("sum", "squares", "within", "heard")


@dataclass(frozen=True)
class PlaceSums:
    """The common places of two surveys, for one technology."""

    offsets_db: Mapping[tuple[str, str], float]
    """Offset of each survey and device, against the mean of all."""
    faintest_dbm: float
    """RSSI, without its device's offset, from which strength counts."""
    places: pl.DataFrame
    """PLACE, and for each survey: scans and walks, 0 if it was not there."""
    heard: pl.DataFrame
    """PLACE, bssid, and for each survey: sum and squares of its walks' mean strength (dB, dB^2), within (squared
    deviations of scans from their walk's mean, dB^2) and heard (scans that heard it), 0 for none."""


def place_sums(surveys: Mapping[str, Dataset], technology: str, cell_m: float) -> PlaceSums:
    """Add up both surveys' labelled scans by cells of ``cell_m``; one session at a time is in memory.

    The result grows with places and access points. A scan has the position of its fingerprint.
    """
    offsets = _offsets(surveys, technology)
    frame = pl.DataFrame(
        [(survey, device, offset) for (survey, device), (offset, _, _) in offsets.items()],
        schema={"survey": pl.String, "device": pl.String, "offset_db": pl.Float64},
        orient="row",
    )
    faintest = max((level for _, level, enough in offsets.values() if enough), default=_FAINTEST_DBM)
    places, heard = [], []
    for survey, scans, readings in _each_walk(surveys, technology):
        cells = [(pl.col(axis) // cell_m).cast(pl.Int32).alias(name) for axis, name in (("x", "column"), ("y", "row"))]
        loud = readings.join(frame.filter(survey=survey), on="device", how="left").with_columns(
            *cells, loudness=(pl.col("rssi_dbm") - pl.col("offset_db").fill_null(0.0) - faintest).clip(0.0)
        )
        visits = (
            scans.with_columns(*cells).group_by(PLACE).agg(scans=pl.len().cast(pl.Int64), walks=pl.lit(1, pl.Int64))
        )
        places.append(_of_survey(visits, PLACE, survey))
        heard.append(_of_survey(_walk_sums(loud, visits), (*PLACE, "bssid"), survey))
        if len(places) == _PARTS:
            places, heard = [_summed(places, PLACE, _VISITS)], [_summed(heard, (*PLACE, "bssid"), _SUMS)]
    plain = {key: offset for key, (offset, _, _) in offsets.items()}
    return PlaceSums(plain, faintest, _summed(places, PLACE, _VISITS), _summed(heard, (*PLACE, "bssid"), _SUMS))


def _walk_sums(loud: pl.DataFrame, visits: pl.DataFrame) -> pl.DataFrame:
    """Mean strength of each access point at each place of a walk, including scans that did not hear it."""
    of_scan = loud.group_by(*PLACE, "scan_id", "bssid").agg(pl.col("loudness").mean())
    loudness = pl.col("loudness")
    sums = of_scan.group_by(*PLACE, "bssid").agg(
        sum=loudness.sum(), within=(loudness**2).sum(), heard=pl.len().cast(pl.Int64)
    )
    return sums.join(visits, on=PLACE).select(
        *PLACE,
        "bssid",
        "heard",
        sum=pl.col("sum") / pl.col("scans"),
        squares=(pl.col("sum") / pl.col("scans")) ** 2,
        within=pl.col("within") - pl.col("sum") ** 2 / pl.col("scans"),
    )


def _of_survey(table: pl.DataFrame, keys: tuple[str, ...], survey: str) -> pl.DataFrame:
    """Add the survey to the names of columns that are not keys."""
    return table.rename({name: f"{name}_{survey}" for name in table.columns if name not in keys})


def _summed(parts: list[pl.DataFrame], keys: tuple[str, ...], values: tuple[str, ...]) -> pl.DataFrame:
    """Add up by key, with columns of each survey even if one has no data."""
    names = [f"{value}_{survey}" for survey in SURVEYS for value in values]
    empty = pl.DataFrame(schema={name: _TYPES.get(name.split("_")[0], pl.Int64()) for name in (*keys, *names)})
    return pl.concat([empty, *parts], how="diagonal").group_by(keys).agg(pl.col(names).sum()).sort(keys)


def _each_walk(surveys: Mapping[str, Dataset], technology: str) -> Iterator[tuple[str, pl.DataFrame, pl.DataFrame]]:
    """Yield survey, labelled scans and their readings, walk by walk; readings have their scan's place and device."""
    columns = ("scan_id", "technology", "building", "floor", "x", "y", "device")
    for survey in SURVEYS:
        dataset = surveys[survey]
        for tables in each_session(dataset.fingerprints, dataset.readings):
            own = pl.col("technology") == technology
            scans = tables.fingerprints.filter(own & pl.all_horizontal(pl.col("floor", "x", "y").is_not_null()))
            placed = scans.select(columns).with_columns(
                pl.col("device").fill_null(_UNKNOWN), pl.col("building").fill_null("")
            )
            readings = tables.readings.select("scan_id", "bssid", "rssi_dbm").join(placed, on="scan_id")
            yield survey, placed, readings


def _offsets(surveys: Mapping[str, Dataset], technology: str) -> dict[tuple[str, str], tuple[float, float, bool]]:
    """Offset of each survey's devices (dB), the faintest level without it (dBm), and whether that is well known."""
    means, faintest = PlaceMeans(), []
    for survey, _, readings in _each_walk(surveys, technology):
        means.add(readings.with_columns(device=pl.format("{}/{}", pl.lit(survey), "device")))
        least = readings.group_by("device").agg(least=pl.col("rssi_dbm").min(), count=pl.len())
        faintest.append(least.with_columns(survey=pl.lit(survey)))
    if not faintest:
        return {}
    levels = pl.concat(faintest).group_by("survey", "device").agg(pl.col("least").min(), pl.col("count").sum())
    rows = levels.select("survey", "device", "least", "count").sort("survey", "device").rows()
    offsets = _robust_offsets(means.shared(), [f"{survey}/{device}" for survey, device, _, _ in rows])
    return {
        (survey, device): (offset, least - offset, count >= LEAST_READINGS)
        for survey, device, least, count in rows
        for offset in (offsets[f"{survey}/{device}"],)
    }


def _robust_offsets(shared: pl.DataFrame, devices: list[str]) -> dict[str, float]:
    """Solve, remove pairs with too large a difference (an access point that moved), and repeat."""

    def step(before: dict[str, float], _round: int) -> dict[str, float]:
        apart = pl.col("rssi_dbm") - pl.col("device").replace_strict(before, default=0.0)
        spread = (apart.max() - apart.min()).over("technology", *PLACE, "bssid")
        return _solved(shared.filter(spread <= _OUTLIER_DB), devices)

    def moved_db(before: dict[str, float], after: dict[str, float]) -> float:
        return max((abs(after[device] - before[device]) for device in devices), default=0.0)

    start = _solved(shared, devices)
    what = "the signal level offsets of devices in two surveys"
    return iterate(what, start, step, moved_db, StoppingRule(tolerance=_SMALL_DB, most_rounds=_MOST_ROUNDS)).state


def _solved(shared: pl.DataFrame, devices: list[str]) -> dict[str, float]:
    return {device: offset_db or 0.0 for device, (offset_db, _) in device_offsets(shared, devices).items()}
