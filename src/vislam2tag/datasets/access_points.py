"""The table of access points: how often, where and how strongly each was heard, and which ones are mobile.

Flags are null if the identifier is not an address (``WAP001``), because such data sets have removed the addresses.

An access point sends one beacon for each of its networks. Manufacturers number the addresses of one radio in the last
hex digits (``..:40``, ``..:41``), or set the local bit and count in the first octet (``cc:..``, ``ce:..``). Addresses
alone are not enough, because devices of one delivery have neighbouring ones. Two addresses are therefore one radio if
they are heard equally strongly at the same moments. One reading may represent all networks of a radio: each has its own
beacon, but none adds information about the place.
"""

from __future__ import annotations

from dataclasses import replace

import networkx as nx
import polars as pl

from vislam2tag.datasets.model import Dataset, RunningTotal, SessionTables, each_session, readings_by_session
from vislam2tag.datasets.schema import ACCESS_POINTS, FINGERPRINTS, READINGS, RTT, SCHEMAS, empty_table, in_schema

LAST_OCTETS = 16
"""Last octets that differ by less may belong to one radio: manufacturers count networks in one hex digit."""
SAME_MOMENT_NS = 500_000_000
"""Beacons of one radio arrive within 0.1 s; a scan returns to a channel after seconds."""
EQUAL_DB = 5.0
"""Root mean square difference up to which two addresses are equally strong. On a floor of a mall 98 % of the pairs with
neighbouring addresses are below it (median 1.3 dB), and pairs of different access points are around 10 dB."""
LEAST_SCANS = 5
"""Smallest number of scans that heard both."""
ADDRESS = r"^[0-9A-Fa-f]{2}(:[0-9A-Fa-f]{2}){5}$"
_PAIR = ("bssid", "other")


def pair_differences(readings: pl.DataFrame) -> pl.DataFrame:
    """Compare the addresses that may belong to one radio, in each scan of some readings.

    Columns: bssid, other (the greater address), scans, squares (sum of squared differences, dB^2). Sums over disjoint
    sets of scans can be added.
    """
    octet = pl.col("bssid").str
    beacons = readings.filter(octet.contains(ADDRESS)).select(
        "scan_id",
        "bssid",
        "rssi_dbm",
        "frequency_mhz",
        "time_ns",
        middle=octet.slice(2, 13),
        first=octet.head(2).str.to_integer(base=16),
        last=octet.tail(2).str.to_integer(base=16),
    )
    pairs = beacons.join(beacons, on=["scan_id", "middle", "frequency_mhz"], suffix="_other", nulls_equal=True).filter(
        (pl.col("bssid") < pl.col("bssid_other")) & _addresses_of_one() & _same_moment()
    )
    difference = (pl.col("rssi_dbm") - pl.col("rssi_dbm_other")).cast(pl.Float64)
    return (
        pairs.group_by("scan_id", "bssid", other="bssid_other")
        .agg(square=difference.mean() ** 2)
        .group_by(_PAIR)
        .agg(scans=pl.len().cast(pl.Int64), squares=pl.col("square").sum())
    )


def _addresses_of_one() -> pl.Expr:
    """Neighbours in the last octet with the same first octet; or the same last octet with a local first octet."""
    same_first = pl.col("first") == pl.col("first_other")
    neighbours = (pl.col("last") - pl.col("last_other")).abs() < LAST_OCTETS
    local = (pl.col("first") // 2) % 2 + (pl.col("first_other") // 2) % 2 > 0
    return (same_first & neighbours) | (local & (pl.col("last") == pl.col("last_other")))


def _same_moment() -> pl.Expr:
    """Whether both were heard at once; without times, whether they are in one scan."""
    return ((pl.col("time_ns") - pl.col("time_ns_other")).abs() <= SAME_MOMENT_NS).fill_null(True)


def radios(bssids: pl.Series, differences: pl.DataFrame) -> pl.DataFrame:
    """Name the radio of each address: columns bssid, radio (its smallest address).

    Identifiers that are not addresses have no known radio (null).
    """
    equal = differences.filter(
        (pl.col("scans") >= LEAST_SCANS) & ((pl.col("squares") / pl.col("scans")).sqrt() <= EQUAL_DB)
    )
    graph = nx.Graph(list(zip(equal["bssid"], equal["other"], strict=True)))
    leader = {bssid: min(group) for group in nx.connected_components(graph) for bssid in group}
    named = pl.DataFrame(
        {"bssid": list(leader), "leader": list(leader.values())}, schema={"bssid": pl.String, "leader": pl.String}
    )
    own = pl.when(pl.col("bssid").str.contains(ADDRESS)).then(pl.col("bssid"))
    return (
        bssids.rename("bssid")
        .to_frame()
        .join(named, on="bssid", how="left", maintain_order="left")
        .select("bssid", radio=pl.coalesce("leader", own))
    )


STRONG_DBM = -55.0
"""A phone hears a transmitter of usual power (20 dBm) this strongly within about 20 m in line of sight."""
FAR_APART_M = 50.0
"""Two places this far apart cannot both be within 20 m of one transmitter, even with a corridor's wave guide."""
FLOORS_APART = 3
"""Three slabs attenuate by 40 dB and more, so a stationary transmitter is not strong on floors this far apart."""
_CELL_M = 5.0
_STRONG_READINGS = 3
"""Strong readings that a cell needs to count, so that one wrong label has no effect."""
_LOCAL_BIT = 2
"""Bit of an address's first octet: locally administered (IEEE 802, 8.4)."""
_PHONE_NAME = (
    r"(?i)^androidap|^androidhotspot|\biphone\b|\bipad\b|^DIRECT-|"
    r"^(galaxy|huawei|honor|oppo|vivo|redmi|oneplus|pixel|xiaomi|nokia|moto|mi|sm)[ _][^ ]"
)
"""Names that phones give their hotspots; ``HUAWEI-2FF4`` with a hyphen is a home router."""
_STANDING_NAME = r"(?i)^DIRECT-.*(hp |epson|canon|brother|lexmark|xerox|kyocera|ricoh|roku|tv|bravia|chromecast)"
"""Stationary Wi-Fi Direct devices: printers and screens."""
NO_NAMES = pl.DataFrame(schema={"bssid": pl.String, "technology": pl.String, "ssid": pl.String, "count": pl.Int64})
"""Names of a data set whose access points have none."""
NOMAP = r"(?i)_nomap$"
"""The suffix by which owners ask not to be mapped; in any case, to be safe."""


_COUNT = (pl.col("count").sum(),)


def _running_totals() -> dict[str, RunningTotal]:
    """Running totals of each access point; their size depends only on the access points and their surroundings.

    ``strong``: the cells of ``_CELL_M`` with strong readings; ``differences``: the result of :func:`pair_differences`.
    """
    heard = (
        pl.col("technology").min(),
        pl.col("readings", "fingerprints", "sessions").sum(),
        pl.col("strongest_dbm").max(),
    )
    return {
        "heard": RunningTotal(("bssid",), heard),
        "floors": RunningTotal(("bssid", "floor")),
        "channels": RunningTotal(("bssid", "frequency_mhz"), _COUNT),
        "strong": RunningTotal(("bssid", "building", "floor", "column", "row"), _COUNT),
        "differences": RunningTotal(_PAIR, (pl.col("scans", "squares").sum(),)),
    }


def access_point_table(fingerprints: pl.LazyFrame, readings: pl.LazyFrame, names: pl.DataFrame) -> pl.DataFrame:
    """Make the table of access points, ordered by BSSID.

    ``names`` has columns bssid, technology, ssid, count: how often each access point was heard with each name. Only the
    readings of one session are in memory at a time.

    ``radio``: the smallest of the addresses of one radio (:func:`merged_radios`).

    ``randomised``: the address is locally administered. Phones draw such addresses at random, but access points with
    several networks derive theirs in the same way, so the flag alone does not identify a phone. Null for BLE, whose
    random addresses look like any other.

    ``mobile``: strong at two places too far apart for one position (``FAR_APART_M``, ``FLOORS_APART``, or in two
    buildings), or with a name that phones give their hotspots. A phone that stayed in one corner with a custom name is
    missed; a repeater that copies an address is flagged. Null if neither position nor name is known.

    ``nomap``: one of its names ends in ``_nomap``; null if no name is known.
    """
    totals = _running_totals()
    for tables in each_session(fingerprints, readings):
        for name, counts in _tally(tables).items():
            totals[name].add(counts)
    total = {name: each.table for name, each in totals.items()}
    if total["heard"].is_empty():
        return empty_table(ACCESS_POINTS)
    table = (
        total["heard"]
        .join(total["floors"].group_by("bssid").agg(floors=pl.col("floor").sort()), on="bssid", how="left")
        .join(_median_frequency(total["channels"]), on="bssid", how="left")
        .join(_names(names), on="bssid", how="left")
        .join(names.group_by("bssid").agg(own=pl.col("technology").min()), on="bssid", how="left")
        .join(_wandering(total["strong"]), on="bssid", how="left")
        .join(radios(total["heard"]["bssid"], total["differences"]), on="bssid", how="left")
        .with_columns(pl.col("floors").fill_null([]), technology=pl.coalesce("own", "technology"))
    )
    return in_schema(ACCESS_POINTS, table.with_columns(**_flags()).drop("phone_name", "far", "own").sort("bssid"))


def _tally(tables: SessionTables) -> dict[str, pl.DataFrame]:
    """Count in one session, by the names of :func:`_running_totals`."""
    scans = tables.fingerprints.select("scan_id", "technology", "building")
    readings = tables.readings.join(scans, on="scan_id", how="left").with_columns(
        column=(pl.col("x") // _CELL_M).cast(pl.Int32, strict=False),
        row=(pl.col("y") // _CELL_M).cast(pl.Int32, strict=False),
    )
    strong = readings.filter((pl.col("rssi_dbm") >= STRONG_DBM) & pl.col("column").is_not_null())
    return {
        "heard": readings.group_by("bssid").agg(
            technology=pl.col("technology").min(),
            readings=pl.len().cast(pl.Int64),
            fingerprints=pl.col("scan_id").n_unique().cast(pl.Int64),
            sessions=pl.lit(1, pl.Int64),
            strongest_dbm=pl.col("rssi_dbm").max(),
        ),
        "floors": readings.select("bssid", "floor").drop_nulls().unique(),
        "channels": readings.drop_nulls("frequency_mhz")
        .group_by("bssid", "frequency_mhz")
        .agg(count=pl.len().cast(pl.Int64)),
        "strong": strong.group_by("bssid", "building", "floor", "column", "row").agg(count=pl.len().cast(pl.Int64)),
        "differences": pair_differences(tables.readings),
    }


def _median_frequency(channels: pl.DataFrame) -> pl.DataFrame:
    """The lower median, which is a channel that was heard."""
    upto = pl.col("count").cum_sum().over("bssid")
    half = pl.col("count").sum().over("bssid") / 2
    return (
        channels.sort("bssid", "frequency_mhz")
        .filter(upto >= half)
        .group_by("bssid", maintain_order=True)
        .first()
        .drop("count")
    )


def _names(names: pl.DataFrame) -> pl.DataFrame:
    """Each access point's most frequent non-empty name, and the flags that follow from its names."""
    named = names.filter(pl.col("ssid").str.len_chars() > 0).group_by("bssid", "ssid").agg(pl.col("count").sum())
    ssid = pl.col("ssid")
    return (
        named.sort(["bssid", "count", "ssid"], descending=[False, True, False])
        .group_by("bssid", maintain_order=True)
        .agg(
            ssid=ssid.first(),
            nomap=ssid.str.contains(NOMAP).any(),
            phone_name=(ssid.str.contains(_PHONE_NAME) & ~ssid.str.contains(_STANDING_NAME)).any(),
        )
    )


def _wandering(strong: pl.DataFrame) -> pl.DataFrame:
    """Whether cells with strong readings of an access point are too far apart for one position: bssid, far."""
    cells = strong.filter(pl.col("count") >= _STRONG_READINGS)
    width = (pl.col("column").max() - pl.col("column").min()) * _CELL_M
    depth = (pl.col("row").max() - pl.col("row").min()) * _CELL_M
    by_floor = cells.group_by("bssid", "building", "floor").agg(extent_m=(width**2 + depth**2).sqrt())
    by_building = by_floor.group_by("bssid", "building").agg(
        far=(pl.col("extent_m").max() > FAR_APART_M) | (pl.col("floor").max() - pl.col("floor").min() >= FLOORS_APART)
    )
    return by_building.group_by("bssid").agg(far=pl.col("far").any() | (pl.len() > 1))


def _flags() -> dict[str, pl.Expr]:
    is_address = pl.col("bssid").str.contains(ADDRESS)
    first_octet = pl.col("bssid").str.head(2).str.to_integer(base=16, strict=False)
    local = (first_octet // _LOCAL_BIT) % 2 == 1
    placed = pl.col("floors").list.len() > 0
    mobile = pl.col("far").fill_null(False) | pl.col("phone_name").fill_null(False)
    known = placed | pl.col("ssid").is_not_null()
    return {
        "randomised": pl.when(is_address & (pl.col("technology") == "wifi")).then(local),
        "mobile": pl.when(is_address & known).then(mobile),
        "nomap": pl.when(is_address).then(pl.col("nomap")),
    }


def merged_radios(dataset: Dataset) -> Dataset:
    """Merge all networks of a radio: one reading for each scan, and one access point for each radio.

    The radio's name replaces the address. RSSI (the mean in dBm, which lowers fading and keeps the scale of a single
    beacon), time, position and sigma are means; frequency is the first. Identifiers without a known radio are
    unchanged. Ranges are not merged but get the radio's name. Tables stay lazy except that of the access points.
    """
    points = dataset.access_points.collect().with_columns(as_one=pl.coalesce("radio", "bssid"))
    names = points.select("bssid", "as_one").lazy()
    readings = readings_by_session(dataset.fingerprints, dataset.readings, lambda own: _merged(own, names))
    merged = {
        FINGERPRINTS: _counted_anew(dataset.fingerprints, readings),
        READINGS: readings,
        ACCESS_POINTS: _merged_points(dataset.fingerprints, readings, points).lazy(),
    }
    if RTT in dataset.tables:
        ranges = dataset.tables[RTT].join(names, on="bssid", how="left", maintain_order="left")
        merged[RTT] = ranges.with_columns(bssid=pl.coalesce("as_one", "bssid")).drop("as_one")
    return replace(dataset, tables={**dataset.tables, **merged})


def _merged(readings: pl.LazyFrame, names: pl.LazyFrame) -> pl.LazyFrame:
    schema = SCHEMAS[READINGS]
    return (
        readings.join(names, on="bssid", how="left", maintain_order="left")
        .group_by("scan_id", pl.coalesce("as_one", "bssid").alias("radio"), maintain_order=True)
        .agg(
            pl.col("rssi_dbm", "time_ns", "x", "y", "sigma").mean(),
            pl.col("frequency_mhz", "floor").drop_nulls().first(),
        )
        .rename({"radio": "bssid"})
        .select(pl.col(column).cast(kind) for column, kind in schema.items())
    )


def _counted_anew(fingerprints: pl.LazyFrame, readings: pl.LazyFrame) -> pl.LazyFrame:
    """Count the remaining readings of each fingerprint."""
    counts = readings.group_by("scan_id").agg(
        readings=pl.len().cast(pl.Int32), labelled=pl.col("x").count().cast(pl.Int32)
    )
    columns = fingerprints.collect_schema().names()
    return (
        fingerprints.drop("readings", "labelled")
        .join(counts, on="scan_id", how="left", maintain_order="left")
        .with_columns(pl.col("readings", "labelled").fill_null(0))
        .with_columns(labelled_share=pl.when(pl.col("readings") > 0).then(pl.col("labelled") / pl.col("readings")))
        .with_columns(pl.col("labelled_share").fill_null(0.0))
        .select(columns)
    )


def _merged_points(fingerprints: pl.LazyFrame, readings: pl.LazyFrame, points: pl.DataFrame) -> pl.DataFrame:
    """Count the radios, and merge the flags of their networks: a flag of one applies to its radio."""
    names = points.select("technology", "ssid", bssid="as_one", count=pl.col("readings").cast(pl.Int64))
    table = access_point_table(fingerprints, readings, names)
    flags = points.group_by(bssid="as_one").agg(pl.col("mobile", "nomap").any(ignore_nulls=False))
    return table.drop("mobile", "nomap").join(flags, on="bssid", how="left").select(table.columns).sort("bssid")
