"""How strong a radio signal can be that a phone reports, and what to report about levels that it cannot have."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import replace

import polars as pl

from vislam2tag.common.findings import Finding
from vislam2tag.intake.quantity import Quantity

SIGNAL_STRENGTH = Quantity(
    name="signal strengths",
    unit="dBm",
    least=-126.0,
    greatest=-1.0,
    kind="absurd_levels",
    cause="0, 127 and -127 stand for 'no value', 100 for 'not heard', or the file has another unit",
    cure="Leave such levels out of the file, or write them in dBm.",
)
"""Receivers report whole dBm. -127 is how Android (``WifiInfo``) and 127 how Bluetooth (Core, HCI) say "no value", and
drivers that measured nothing report 0. Above, a transmitter of 20 dBm at a hand's breadth arrives with less than
-1 dBm, and receivers saturate before; below -126 dBm is less than the thermal noise of 1 MHz (-114 dBm).
"""
_WITH_ZERO = replace(SIGNAL_STRENGTH, greatest=0.0)
_MEASURE_ZERO = frozenset({"uji"})
"""Formats whose specification has 0 dBm as a measured level; datasets/formats/uji.py names it."""
NOT_HEARD = 100.0
"""What published tables write for "not heard"."""


def strength_of(formats: Iterable[str]) -> Quantity:
    """Return the range of levels in data of these formats, by the formats' own specifications."""
    return SIGNAL_STRENGTH if _MEASURE_ZERO.isdisjoint(formats) else _WITH_ZERO


def in_range(level_dbm: float, strength: Quantity = SIGNAL_STRENGTH) -> bool:
    """Whether a single level can be true."""
    return strength.least <= level_dbm <= strength.greatest


def may_lack_its_sign(level: float) -> bool:
    """Whether a level is positive as if its sign was lost; 100 stands for "not heard"."""
    return level != NOT_HEARD and in_range(-level)


def is_sign_lost(positive: int, levels: int) -> bool:
    """Whether so many levels of a file's are positive that the sign was lost on the way."""
    return 2 * positive > levels


def lost_sign(file: str, count: int, lines: list[int], done: str) -> Finding:
    """Report positive levels of a file in which most are; ``lines`` are the first ones of ``count``."""
    message = f"most levels of the file are positive: the sign was lost (65 for -65); {done}. Negate the levels."
    finding = Finding.at_lines("lost_sign", file, lines, message)
    return finding.model_copy(update={"count": count})


def level_findings(
    rows: pl.DataFrame, file: str, done: str, strength: Quantity = SIGNAL_STRENGTH, of: int | None = None
) -> list[Finding]:
    """Report the levels of ``rows`` (``row``, ``rssi_dbm``) that are out of range; ``done`` says what happens to them.

    Null is no level. ``of`` is how many levels the file has, if ``rows`` are only some of them.
    """
    levels = rows.select("row", pl.col("rssi_dbm").cast(pl.Float64)).drop_nulls()
    odd = levels.filter(~strength.contains(pl.col("rssi_dbm")))
    unsigned = SIGNAL_STRENGTH.contains(-pl.col("rssi_dbm")) & (pl.col("rssi_dbm") != NOT_HEARD)
    positive = odd.filter(unsigned)["row"].to_list()
    if not is_sign_lost(len(positive), of or levels.height):
        return strength.outside(file, odd["row"].to_list(), done)
    rest = odd.filter(~unsigned)["row"].to_list()
    return [lost_sign(file, len(positive), positive, done), *strength.outside(file, rest, done)]


def without_absurd_levels(
    rows: pl.DataFrame, file: str, strength: Quantity = SIGNAL_STRENGTH
) -> tuple[pl.DataFrame, list[Finding]]:
    """Make ``rssi_dbm`` null (and float32) where it is out of range, and report these rows."""
    findings = level_findings(rows, file, "these rows are kept without their level", strength)
    return rows.with_columns(measured(strength)), findings


def measured(strength: Quantity = SIGNAL_STRENGTH) -> pl.Expr:
    """The column ``rssi_dbm`` (float32), null where it is out of range."""
    return pl.when(strength.contains(pl.col("rssi_dbm"))).then(pl.col("rssi_dbm").cast(pl.Float32))
