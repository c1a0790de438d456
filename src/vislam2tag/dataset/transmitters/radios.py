"""Which addresses are the networks of one radio: an access point sends one beacon for each of its networks.

Manufacturers count such addresses in the last hex digits (``..:40``, ``..:41``) or set the local bit and count in the
first octet (``cc:..``, ``ce:..``). Addresses alone are not enough, since devices of one delivery have neighbouring
ones: two addresses are one radio if they are heard equally loud at the same moments.
"""

from __future__ import annotations

from collections.abc import Iterable

import networkx as nx
import polars as pl

LAST_OCTETS = 16
"""Last octets that differ by less may be one radio's: manufacturers count networks in one hex digit."""
SAME_MOMENT_NS = 500_000_000
"""Beacons of one radio come within 0.1 s; a scan returns to a channel after seconds."""
EQUAL_DB = 5.0
"""Root mean square difference up to which two addresses are heard equally loud. On a floor of a mall 98 % of pairs with
neighbouring addresses lie below (median 1.3 dB), and pairs of different access points around 10 dB."""
LEAST_SCANS = 5
"""Scans that must have heard both; fewer prove nothing."""
ADDRESS = r"^[0-9A-Fa-f]{2}(:[0-9A-Fa-f]{2}){5}$"
_PAIR = ("bssid", "other")


def pair_differences(readings: pl.DataFrame) -> pl.DataFrame:
    """Compare the addresses that may be one radio's in each scan of some readings.

    Columns bssid, other (the greater address), scans, squares (sum of squared differences, dB^2): sums over disjoint
    sets of scans add up.
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
    """Neighbours in the last octet under one first octet; or one last octet where a first octet is given locally."""
    same_first = pl.col("first") == pl.col("first_other")
    neighbours = (pl.col("last") - pl.col("last_other")).abs() < LAST_OCTETS
    local = (pl.col("first") // 2) % 2 + (pl.col("first_other") // 2) % 2 > 0
    return (same_first & neighbours) | (local & (pl.col("last") == pl.col("last_other")))


def _same_moment() -> pl.Expr:
    """Whether both were heard at once; where there are no times, the scan has to do."""
    return ((pl.col("time_ns") - pl.col("time_ns_other")).abs() <= SAME_MOMENT_NS).fill_null(True)


def sum_of_differences(parts: Iterable[pl.DataFrame]) -> pl.DataFrame:
    """Add up what :func:`pair_differences` found in disjoint sets of scans."""
    return pl.concat(parts).group_by(_PAIR).agg(pl.col("scans", "squares").sum())


def radios(bssids: pl.Series, differences: pl.DataFrame) -> pl.DataFrame:
    """Name the radio of each address: columns bssid, radio (the least address that belongs to it).

    Identifiers that are no addresses have no known radio (null).
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
