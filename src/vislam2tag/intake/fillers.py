"""Input rules for the level that means "not heard".

The "not heard" level is stated by a table's format, or it is a filler that is detected. A filler fills many cells of
most columns and is at the edge of the range of all other levels, or outside it. Measured levels vary: none of them
fills half of a table, and the smallest and the largest are the rarest. A receiver that reports all weak signals with
one level also makes a peak there, so the user is asked about a smaller peak next to the other levels.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from enum import Enum

import polars as pl

from vislam2tag.common.findings import Finding, Severity
from vislam2tag.intake.level_scales import LevelRange

_MIN_CELLS = 6
"""Fewer equal levels may be chance."""
_MAX_SHARE = 0.5
"""No measured level has a larger share of the cells."""
_MANY = 0.1
_PEAK = 3
"""A filler that does not fill most cells is this many times as frequent as any other level."""
_GAP_DB = 10.0
"""Measured levels do not leave a wider gap next to a frequent level."""


class Judgement(Enum):
    """Result of the search for a table's filler."""

    NONE = "none"
    FOUND = "found"
    ASK = "ask"


@dataclass(frozen=True)
class Filler:
    """A level that means "not heard" although nothing states so, or that may mean it (``ASK``)."""

    judgement: Judgement
    level: float = float("nan")
    share: float = 0.0
    """Share of the table's cells with a level."""
    nearest: float = float("nan")
    """The closest other level; NaN if there is none."""


_NO_FILLER = Filler(Judgement.NONE)


def filler_of(heard: pl.DataFrame, access_points: int, stated: int, strength: LevelRange) -> Filler:
    """Judge which level of a table is its filler.

    ``heard``: ``bssid`` and ``rssi_dbm`` of all cells that are neither empty nor have the stated level; ``stated``: the
    number of cells with the stated level.
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
    """A level out of range that makes up most of all such levels; several different ones have another cause."""
    if odd.is_empty():
        return None
    top = odd.sort("cells").row(-1, named=True)
    if top["spread"] and top["cells"] >= _MANY * cells and 2 * top["cells"] > odd["cells"].sum():
        return Filler(Judgement.FOUND, top["rssi_dbm"], top["cells"] / cells)
    return None


def _at_edge(levels: pl.DataFrame, known: int) -> Filler:
    """The smallest or largest level, if it is too frequent to be measured; ``known`` cells are not heard anyway."""
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


_MIN_SCANS = 10
_FULL = 0.95
_MORE_FREQUENT = 2


def without_filler(rows: pl.DataFrame, sender: str, file: str) -> tuple[pl.DataFrame, list[Finding]]:
    """Skip and report rows that mean "not heard" in a file of scans (column ``scan``).

    A recorder that lists nearly all addresses in each scan writes a level for those that were not heard. It is the
    weakest one, and more frequent than any that was measured.
    """
    scans = rows["scan"].n_unique() if "scan" in rows.columns else 0
    if scans < _MIN_SCANS or rows.height < _FULL * scans * rows[sender].n_unique():
        return rows, []
    counts = rows["rssi_dbm"].drop_nulls().value_counts().sort("count", descending=True)
    (level, cells), *others = counts.rows() or [(math.nan, 0)]
    nearest = min((other for other, _ in others), default=level)
    if not level < nearest or cells < max(_MIN_CELLS, _MORE_FREQUENT * others[0][1]):
        return rows, []
    filler = Filler(Judgement.FOUND, level, cells / rows.height, nearest)
    kept = rows.filter(pl.col("rssi_dbm").ne_missing(level))
    return kept, [filler_found(file, filler, cells, None)]


def filler_found(file: str, filler: Filler, cells: int, stated: float | None) -> Finding:
    """Report a filler that is read as "not heard"."""
    instead = "" if stated is None or math.isnan(stated) else f", not {stated:g} as the format states"
    where = "the most frequent level out of range" if math.isnan(filler.nearest) else "the most frequent level"
    edge = "" if math.isnan(filler.nearest) else " and at the edge of all others"
    message = (
        f"{filler.level:g} is {where} ({100 * filler.share:.0f} % of the levels){edge}, so it is read as 'not "
        f"heard'{instead}. No action needed if that is right"
    )
    return Finding(kind="unstated_filler", file=file, count=cells, message=message)


def never_not_heard(file: str, stated: float, filler: Filler = _NO_FILLER) -> Finding:
    """Report that the level that the user states as "not heard" is not in a file; ``filler`` may be it instead."""
    instead = "" if filler.judgement is Judgement.NONE else _instead(filler)
    message = f"no level is {stated:g}, which is stated as 'not heard'{instead}. Correct --not-heard, or leave it out"
    return Finding(kind="never_not_heard", file=file, count=1, message=message, severity=Severity.WARNING)


def _instead(filler: Filler) -> str:
    return f"; {100 * filler.share:.0f} % of the levels are {filler.level:g}, which may mean 'not heard' instead"


def all_heard(file: str, rows: int) -> Finding:
    """Report that a table has no cell that is not heard, and no filler that could be recognised."""
    message = (
        "every access point is heard in every row. No action needed if that is right; if a level means 'not heard', "
        "pass it with --not-heard LEVEL"
    )
    return Finding(kind="all_heard", file=file, count=rows, message=message, severity=Severity.WARNING)


def question(filler: Filler, stated: float) -> str:
    """Ask for the meaning of a level that may be a filler."""
    near = "there is no other level" if math.isnan(filler.nearest) else f"the next level is {filler.nearest:g}"
    return (
        f"{100 * filler.share:.0f} % of the levels are {filler.level:g} ({near}). If it means 'not heard', pass "
        f"--not-heard {filler.level:g}; if it was measured, pass --not-heard {stated:g}"
    )
