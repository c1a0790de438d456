"""Simulate a survey, label it, and look at the labels with Polars."""

from __future__ import annotations

import tempfile
from pathlib import Path

import polars as pl

from vislam2tag.api import Settings, process, regular_survey, simulate


def main() -> None:
    """Print how many readings were labelled, and where the strongest access point was heard best."""
    with tempfile.TemporaryDirectory() as folder:
        survey, out = Path(folder) / "survey", Path(folder) / "labels"
        simulate(regular_survey(seed=5, floors=(0,), sessions=1, duration_s=90.0), survey)
        summary = process(survey, out, Settings(strategy="smoother"), jobs=2)
        print(f"{summary.sessions} sessions, {summary.distance_m:.0f} m walked, findings: {summary.findings or 'none'}")

        wifi = pl.read_parquet(out / "wifi" / "*.parquet")
        print(wifi.group_by("status").len().sort("len", descending=True))
        heard_best = (
            wifi.drop_nulls("x").sort("rssi_dbm", descending=True).group_by("bssid", maintain_order=True).first()
        )
        print(heard_best.select("bssid", "rssi_dbm", "floor", "x", "y").head(5))


if __name__ == "__main__":
    main()
