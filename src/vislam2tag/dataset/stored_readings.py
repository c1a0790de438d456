"""A data set that was made before the rules about radio readings: brought to them when it is opened."""

from __future__ import annotations

from dataclasses import replace

import polars as pl

from vislam2tag.common.findings import Finding
from vislam2tag.dataset.model import Dataset
from vislam2tag.dataset.schema import ACCESS_POINTS, FINGERPRINTS, READINGS, RTT
from vislam2tag.dataset.transmitters.access_points import access_point_table
from vislam2tag.dataset.transmitters.privacy import counted_without
from vislam2tag.intake.addresses import MASKED, masked_addresses, normal_address
from vislam2tag.intake.quantity import Quantity
from vislam2tag.intake.signal_strength import level_findings, strength_of

FILE = f"{READINGS}.parquet"
"""The file of findings about readings that are left out when a data set is opened."""
_DONE = "these readings are left out; make the data set again to be rid of them"


def with_rules(dataset: Dataset) -> Dataset:
    """Bring addresses to one notation; leave readings out whose address or level is none, and report them.

    A data set that keeps the rules comes back as it is; of any other the table of access points is counted again.
    """
    points = dataset.access_points.select("bssid", "technology", "ssid", count=pl.col("readings").cast(pl.Int64))
    known = points.collect()
    names = {name: new for name in known["bssid"] if (new := normal_address(name)) != name or new in MASKED}
    strength = strength_of(source.kind for source in dataset.info.sources)
    counted = dataset.readings.select(all=pl.len(), odd=(~_kept(strength)).sum())
    count, odd = counted.collect(engine="streaming").row(0)
    if not names and not odd:
        return dataset
    readings = _named(dataset.readings, names)
    masked = pl.col("bssid").is_in(list(MASKED))
    kept = readings.filter(~masked, _kept(strength))
    gone = readings.filter(masked | ~_kept(strength))
    tables = {**dataset.tables, READINGS: kept, FINGERPRINTS: counted_without(dataset.fingerprints, gone)}
    if RTT in dataset.tables:
        tables[RTT] = _named(dataset.tables[RTT], names).filter(~masked)
    counts = known.with_columns(pl.col("bssid").replace(old=names)).filter(pl.col("ssid").is_not_null())
    tables[ACCESS_POINTS] = access_point_table(tables[FINGERPRINTS], kept, counts).lazy()
    findings = (*dataset.info.findings, *_findings(gone.with_row_index("row", offset=1).collect(), count, strength))
    return replace(dataset, info=dataset.info.model_copy(update={"findings": findings}), tables=tables)


def _kept(strength: Quantity) -> pl.Expr:
    return strength.contains(pl.col("rssi_dbm").cast(pl.Float64)).fill_null(value=True)


def _named(table: pl.LazyFrame, names: dict[str, str]) -> pl.LazyFrame:
    return table.with_columns(pl.col("bssid").replace(old=names)) if names else table


def _findings(gone: pl.DataFrame, count: int, strength: Quantity) -> list[Finding]:
    masked = gone.filter(pl.col("bssid").is_in(list(MASKED)))
    found = level_findings(gone.filter(~pl.col("bssid").is_in(list(MASKED))), FILE, _DONE, strength, count)
    if masked.height:
        found.append(masked_addresses(FILE, masked["row"].to_list(), masked["bssid"].unique().to_list()))
    return [each.model_copy(update={"lines": ()}) for each in found]
