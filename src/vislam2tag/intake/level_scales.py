"""Input rules for levels: their range in dBm, and other forms. How they are recognised and become dBm.

Measured levels are mostly weak: in no walk of public data sets are more than 5 % stronger than -40 dBm. So small
numbers are rare if a sign is missing, and frequent if numbers grow with the signal: percent, or dB above a weakest one.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, replace

import numpy as np
import polars as pl

from vislam2tag.common.findings import ROWS_NAMED, Finding, FindingKind, at_lines_if

NOT_HEARD = 100.0
"""What published tables write for "not heard"."""
GREATEST = 126.0
"""No level has a greater absolute value, in dBm or any form that is recognised."""
NO_VALUE = (0.0, NOT_HEARD)
"""Numbers that often mean "no value" or "not heard"."""
_FEW = 0.05
_LEAST_UNSIGNED = 38.0
"""Levels without their sign: at most the share ``_FEW`` is smaller."""


@dataclass(frozen=True)
class LevelScale:
    """A linear relation between a file's numbers and dBm, by two points (number, dBm) with different numbers."""

    first: tuple[float, float]
    second: tuple[float, float]

    @property
    def _slope(self) -> float:
        return (self.second[1] - self.first[1]) / (self.second[0] - self.first[0])

    def dbm(self, number: pl.Expr) -> pl.Expr:
        """Levels of numbers."""
        return (number - self.first[0]) * self._slope + self.first[1]

    def number(self, dbm: float) -> float:
        """The file's number for a level."""
        return (dbm - self.first[1]) / self._slope + self.first[0]


@dataclass(frozen=True)
class OtherLevels:
    """A form of levels that is not dBm."""

    kind: FindingKind
    seen: str
    """What shows it: a clause."""
    cure: str
    """How to convert them."""
    option: str
    """What to pass to ``import`` instead."""
    least: float
    """The smallest number in this form; the greatest is ``greatest``."""
    greatest: float

    def contains(self, values: pl.Expr) -> pl.Expr:
        """Whether values can be levels in this form."""
        return values.is_between(self.least, self.greatest)

    def finding(self, file: str, count: int, lines: list[int], done: str) -> Finding:
        """Report ``count`` levels; ``lines`` are the first ones, ``done`` says what happens to them."""
        message = f"{self.seen}; {done}. {self.cure}."
        return Finding(kind=self.kind, file=file, count=count, message=message, lines=tuple(lines[:ROWS_NAMED]))

    @property
    def question(self) -> str:
        """What to do to import a file of such levels."""
        return f"{self.seen}. {self.cure}, or pass {self.option}"


WITHOUT_SIGN = OtherLevels(
    "lost_sign",
    "most levels of the file are positive, so the minus sign is missing (65 instead of -65)",
    "Negate the levels",
    "--levels 1=-1,100=-100",
    1.0,
    GREATEST,
)
GROWING = OtherLevels(
    "levels_not_dbm",
    f"most levels of the file are positive, and more than 5 % are below {_LEAST_UNSIGNED:g}, so they are percent or "
    "count from a weakest level",
    "Convert them to dBm: percent / 2 - 100, or the weakest level plus the number",
    "--levels 0=-100,100=-50 for percent, --levels 0=-105,105=0 for numbers that count from -105 dBm",
    0.0,
    GREATEST,
)
NORMALISED = OtherLevels(
    "levels_not_dbm",
    "most levels of the file are between -1 and 1, so they are normalised",
    "Convert them to dBm: weakest level + number * (strongest - weakest level)",
    "--levels 0=WEAKEST,1=STRONGEST with the levels in dBm that 0 and 1 stand for, such as --levels 0=-104,1=0",
    -1.0,
    1.0,
)


def may_be_other(level: float) -> bool:
    """Whether a number out of the range of dBm may be a level in another form; 0 and 100 mean "no value", too."""
    return abs(level) <= GREATEST and level not in NO_VALUE


def other_levels(levels: pl.Series, of: int | None = None) -> OtherLevels | None:
    """Return the form of a file's levels; None if most of them are not in another form.

    ``levels`` (n,): all numbers, or only those out of the range of dBm, of ``of`` numbers.
    """
    known = levels.filter((levels.abs() <= GREATEST) & ~levels.is_in(NO_VALUE))
    most = ((of or len(levels)) - len(levels) + len(known)) / 2
    small = known.filter(known.abs() <= 1)
    if len(small) > most and (small != small.round()).any():
        return NORMALISED
    positive = known.filter(known > 0)
    if len(positive) <= most:
        return None
    return WITHOUT_SIGN if np.quantile(positive, _FEW) >= _LEAST_UNSIGNED else GROWING


CURE = "Remove such levels from the file, or write them in dBm."
_LEVELS = "signal strengths"
_CAUSE = "0, 127 and -127 often mean 'no value' and 100 'not heard', or the file uses another unit"


@dataclass(frozen=True)
class LevelRange:
    """The range, dBm, in which a signal strength can be true; both bounds are included."""

    least: float
    greatest: float

    def contains(self, values: pl.Expr) -> pl.Expr:
        """Whether values are finite and in the range; null stays null."""
        return values.is_finite() & values.is_between(self.least, self.greatest)

    def outside(self, file: str, lines: list[int], done: str) -> list[Finding]:
        """Report the 1-based lines whose values are outside the range; ``done`` says what happens to them."""
        possible = f"from {self.least:g} to {self.greatest:g} dBm"
        message = f"{_LEVELS} must be {possible}; {done}. Possible cause: {_CAUSE}. {CURE}"
        return at_lines_if("absurd_levels", file, lines, message)


SIGNAL_STRENGTH = LevelRange(-GREATEST, -1.0)
"""Receivers report whole dBm. "No value" is -127 in Android (``WifiInfo``), 127 in Bluetooth (Core, HCI), and 0 in
drivers that measured nothing. The upper bound: a transmitter of 20 dBm at a hand's breadth arrives with less than -1
dBm, and receivers saturate before. The lower bound: -126 dBm is below the thermal noise of 1 MHz (-114 dBm).
"""
_WITH_ZERO = replace(SIGNAL_STRENGTH, greatest=0.0)
_MEASURE_ZERO = frozenset({"uji"})
"""Formats whose specification has 0 dBm as a measured level; datasets/formats/uji.py names it."""


def strength_of(formats: Iterable[str]) -> LevelRange:
    """Return the range of levels in data of these formats, by the formats' own specifications."""
    return SIGNAL_STRENGTH if _MEASURE_ZERO.isdisjoint(formats) else _WITH_ZERO


def in_range(level_dbm: float, strength: LevelRange = SIGNAL_STRENGTH) -> bool:
    """Whether a level is in the range."""
    return strength.least <= level_dbm <= strength.greatest
