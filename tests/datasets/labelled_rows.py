"""Rows of labelled tables and trajectories as ``process`` writes them, made by hand."""

from __future__ import annotations

from typing import Any

import polars as pl

from vislam2tag.labeling.tables import SCHEMAS

START_NS = 5_000_000_000_000
S = 1_000_000_000
"""Nanoseconds in a second."""


def labelled(table: str, rows: list[dict[str, Any]]) -> pl.DataFrame:
    """Fill up rows of ``table``: one every 0.1 s, on floor 1, ``ok`` where they have a position."""
    filled = [
        {
            "floor": 1,
            "device": "LG",
            "session": "walk",
            "row": number + 1,
            "time_ns": START_NS + number * S // 10,
            "status": "ok" if row.get("x") is not None else "tracking_lost",
        }
        | row
        for number, row in enumerate(rows)
    ]
    return pl.DataFrame(filled, schema=SCHEMAS[table] | {"row": pl.Int64()}).select(list(SCHEMAS[table]))


def wifi(*rows: dict[str, Any]) -> pl.DataFrame:
    """Readings of scan 7 from access points a, b, c, ... unless they say else."""
    return labelled(
        "wifi",
        [
            {"scan": 7, "bssid": chr(ord("a") + number), "ssid": "net", "rssi_dbm": -60.0} | row
            for number, row in enumerate(rows)
        ],
    )


def trajectory(points: list[tuple[float, float] | None], step_s: float = 0.1, turn: Any = (0, 0, 0, 1)) -> pl.DataFrame:
    """Frames every ``step_s`` at these places; None: no position."""
    rows = [
        {
            "time_ns": START_NS + round(number * step_s * S),
            "x": None if point is None else point[0],
            "y": None if point is None else point[1],
            **dict(zip(("qx", "qy", "qz", "qw"), (None,) * 4 if point is None else turn, strict=True)),
        }
        for number, point in enumerate(points)
    ]
    return labelled("trajectory", rows)
