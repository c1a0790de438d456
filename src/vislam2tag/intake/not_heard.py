"""Which level of a table stands for "not heard": the one that its format states, or a filler that is found.

A filler fills many cells of most columns and is at the edge of the range of all other levels, or outside of it.
Measured levels vary: none of them fills half of a table, and the least and the greatest are the rarest. A receiver that
reports all weak signals by one level makes a peak there, too: a smaller peak next to the other levels stays a question.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from enum import Enum

import polars as pl

from vislam2tag.common.findings import Finding, Severity
from vislam2tag.intake.readings import Quantity

_MIN_CELLS = 6
"""Fewer equal levels may be chance."""
_MAX_SHARE = 0.5
"""No measured level is in so large a share of the cells."""
_MANY = 0.1
_PEAK = 3
"""A filler that does not fill most cells is in so many times as many as any other level."""
_GAP_DB = 10.0
"""Measured levels do not leave so wide a gap before one that is frequent."""


class Judgement(Enum):
    """What is known of a table's filler."""

    NONE = "none"
    FOUND = "found"
    ASK = "ask"


@dataclass(frozen=True)
class Filler:
    """A level that stands for "not heard" though nothing states so, or that may (``ASK``)."""

    judgement: Judgement
    level: float = float("nan")
    share: float = 0.0
    """Of the table's cells with a level."""
    nearest: float = float("nan")
    """The nearest other level; NaN if there is none."""


_NO_FILLER = Filler(Judgement.NONE)


def filler_of(heard: pl.DataFrame, access_points: int, stated: int, strength: Quantity) -> Filler:
    """Judge which level of a table is its filler.

    ``heard``: ``bssid`` and ``rssi_dbm`` of all cells that are neither empty nor have the stated level; ``stated``: how
    many these are.
    """
    counts = (
        heard.group_by("rssi_dbm")
        .agg(cells=pl.len().cast(pl.Int64), columns=pl.col("bssid").n_unique())
        .sort("rssi_dbm")
        .with_columns(spread=(pl.col("columns") * 2 >= access_points) & (pl.col("cells") >= _MIN_CELLS))
    )
    inside = strength.contains(pl.col("rssi_dbm"))
    outside = _outside(counts.filter(~inside), heard.height)
    if outside is not None:
        return outside
    return _at_edge(counts.filter(inside), stated + int(counts.filter(~inside)["cells"].sum()))


def _outside(odd: pl.DataFrame, cells: int) -> Filler | None:
    """A level out of range that is most of all such levels; several different ones have another cause."""
    if odd.is_empty():
        return None
    top = odd.sort("cells").row(-1, named=True)
    if top["spread"] and top["cells"] >= _MANY * cells and 2 * top["cells"] > odd["cells"].sum():
        return Filler(Judgement.FOUND, top["rssi_dbm"], top["cells"] / cells)
    return None


def _at_edge(levels: pl.DataFrame, known: int) -> Filler:
    """The least or the greatest level, if it is far too frequent to be one; ``known`` cells are not heard anyway."""
    cells = int(levels["cells"].sum())
    if levels.height < 2:
        alone = levels.row(0, named=True) if levels.height and not known else None
        asked = alone is not None and alone["spread"]
        return Filler(Judgement.ASK, alone["rssi_dbm"], 1.0) if alone is not None and asked else _NO_FILLER
    found = [_judged(levels, edge, cells, known) for edge in (0, levels.height - 1)]
    return max(found, key=lambda each: (each.judgement is not Judgement.NONE, each.share))


def _judged(levels: pl.DataFrame, edge: int, cells: int, known: int) -> Filler:
    one = levels.row(edge, named=True)
    others = levels.filter(pl.col("rssi_dbm") != one["rssi_dbm"])
    nearest = float(levels["rssi_dbm"][1 if edge == 0 else edge - 1])
    share, most = one["cells"] / cells, others["cells"].sort()[-1]
    if not one["spread"] or one["cells"] <= most:
        return _NO_FILLER
    if share >= _MAX_SHARE and others.height > 1:
        return Filler(Judgement.FOUND, one["rssi_dbm"], share, nearest)
    peak = share >= _MANY and one["cells"] >= _PEAK * most
    if known or not peak:
        return _NO_FILLER
    apart = abs(one["rssi_dbm"] - nearest) >= _GAP_DB and others.height > 1
    return Filler(Judgement.FOUND if apart else Judgement.ASK, one["rssi_dbm"], share, nearest)


def filler_found(file: str, filler: Filler, cells: int, stated: float | None) -> Finding:
    """Report a filler that is taken as "not heard"."""
    instead = "" if stated is None else f", not {stated:g} as the format states"
    where = "the most frequent level out of range" if math.isnan(filler.nearest) else "the most frequent level"
    edge = "" if math.isnan(filler.nearest) else " and at the edge of all others"
    message = (
        f"{filler.level:g} is {where} ({100 * filler.share:.0f} % of the levels){edge}: it stands for 'not heard' "
        f"here{instead}, and is left out. No action needed if that is right"
    )
    return Finding(kind="unstated_filler", file=file, count=cells, message=message)


def all_heard(file: str, rows: int) -> Finding:
    """Report that a table has no cell that is not heard, and no filler that could be recognised."""
    message = (
        "every access point is heard in every row; if a level stands for 'not heard', it could not be recognised. "
        "No action needed if all were heard; else give --not-heard LEVEL"
    )
    return Finding(kind="all_heard", file=file, count=rows, message=message, severity=Severity.WARNING)


def question(filler: Filler, stated: float) -> str:
    """Ask what a level stands for that may be a filler."""
    near = "no other level is there" if math.isnan(filler.nearest) else f"the next level is {filler.nearest:g}"
    return (
        f"{100 * filler.share:.0f} % of the levels are {filler.level:g} ({near}): does it stand for 'not heard', "
        f"or was it measured? Give --not-heard {filler.level:g} in the first case, --not-heard {stated:g} in the second"
    )
