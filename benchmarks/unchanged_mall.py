"""How much is flagged in a real building that stayed as it is: halves of a data set's walks against each other.

vislam2tag import ../shared/data/ilc20/site2-F4.tar.xz --out mall && python benchmarks/unchanged_mall.py mall
"""

from __future__ import annotations

import sys
from dataclasses import replace
from pathlib import Path

import polars as pl

from vislam2tag.dataset.comparing.change_record import CHANGED_POINTS
from vislam2tag.dataset.comparing.changes import CHANGED, UNCHANGED, survey_changes
from vislam2tag.dataset.folder import open_dataset
from vislam2tag.dataset.model import Dataset
from vislam2tag.dataset.schema import FINGERPRINTS, READINGS

CELLS_M = (4.0, 8.0)


def main(folder: Path) -> None:
    """Print, for each technology, size of places and way to halve, how many access points and places are flagged."""
    dataset = open_dataset(folder)
    names = dataset.sessions.select("session", "started").collect().sort("started", "session")["session"].to_list()
    halves = {"every other walk": names[::2], "the later walks": names[len(names) // 2 :]}
    print("| technology | place | held against the others | access points told | places told |")
    print("| --- | --- | --- | --- | --- |")
    for technology in dataset.fingerprints.select("technology").unique().collect()["technology"].sort():
        for cell_m in CELLS_M:
            for way, later in halves.items():
                base = [name for name in names if name not in later]
                found = survey_changes(_part(dataset, base), _part(dataset, later), technology, cell_m)
                points = _share(found.access_points, CHANGED_POINTS)
                print(f"| {technology} | {cell_m:g} m | {way} | {points} | {_share(found.places, (CHANGED,))} |")


def _part(dataset: Dataset, sessions: list[str]) -> Dataset:
    scans = dataset.fingerprints.filter(pl.col("session").is_in(sessions))
    readings = dataset.readings.join(scans.select("scan_id"), on="scan_id", how="semi", maintain_order="left")
    return replace(dataset, tables={**dataset.tables, FINGERPRINTS: scans, READINGS: readings})


def _share(table: pl.DataFrame, told: tuple[str, ...]) -> str:
    """How many of those that could be compared are told."""
    count = table.filter(pl.col("change").is_in(told)).height
    return f"{count} of {count + table.filter(pl.col('change') == UNCHANGED).height}"


if __name__ == "__main__":
    main(Path(sys.argv[1]))
