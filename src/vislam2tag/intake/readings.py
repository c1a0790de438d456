"""Input rules for radio readings: address notation, range of levels, and the level that means "not heard".

The "not heard" level is stated by a table's format, or it is a filler that is detected. A filler fills many cells of
most columns and is at the edge of the range of all other levels, or outside it. Measured levels vary: none of them
fills half of a table, and the smallest and the largest are the rarest. A receiver that reports all weak signals with
one level also makes a peak there, so the user is asked about a smaller peak next to the other levels.
"""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, replace
from enum import Enum

import polars as pl

from vislam2tag.common.findings import Finding, Severity, at_lines_if
from vislam2tag.intake.cells import LEVEL_UNIT
from vislam2tag.intake.level_scales import GREATEST, other_levels

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


def level_findings(
    rows: pl.DataFrame, file: str, done: str, strength: LevelRange = SIGNAL_STRENGTH, of: int | None = None
) -> list[Finding]:
    """Report the levels of ``rows`` (``row``, ``rssi_dbm``) that are out of range; ``done`` says what happens to them.

    Null is not a level. ``of`` is the number of levels in the file if ``rows`` are only some of them.
    """
    levels = rows.select("row", pl.col("rssi_dbm").cast(pl.Float64)).drop_nulls()
    odd = levels.filter(~strength.contains(pl.col("rssi_dbm")))
    other = other_levels(levels["rssi_dbm"], of)
    if other is None:
        return strength.outside(file, odd["row"].to_list(), done)
    its = other.contains(pl.col("rssi_dbm"))
    lines, rest = odd.filter(its)["row"].to_list(), odd.filter(~its)["row"].to_list()
    return [other.finding(file, len(lines), lines, done), *strength.outside(file, rest, done)]


def without_absurd_levels(rows: pl.DataFrame, file: str) -> tuple[pl.DataFrame, list[Finding]]:
    """Make ``rssi_dbm`` null (and float32) where it is out of range, and report these rows."""
    return rows.with_columns(measured()), level_findings(rows, file, "these rows are kept without their level")


def measured() -> pl.Expr:
    """The column ``rssi_dbm`` (float32), null if it is out of range."""
    return pl.when(SIGNAL_STRENGTH.contains(pl.col("rssi_dbm"))).then(pl.col("rssi_dbm").cast(pl.Float32))


_MINUS = "^[\u2212\u2013]"


def level_number(text: pl.Expr) -> pl.Expr:
    """Read levels with either decimal mark, any minus sign and with or without the unit; null if not a number."""
    plain = text.cast(pl.String).str.strip_chars().str.replace(LEVEL_UNIT, "")
    return plain.str.replace(",", ".", literal=True).str.replace(_MINUS, "-").cast(pl.Float64, strict=False)


def level_of(text: str) -> float:
    """:func:`level_number` of one text; NaN if it is not a number."""
    plain = re.sub(LEVEL_UNIT, "", text.strip()).replace(",", ".", 1)
    try:
        return float(re.sub(_MINUS, "-", plain))
    except ValueError:
        return math.nan


_OCTETS = (1, 2, 3, 6)
"""Possible numbers of octets in a group: ``aa:bb:cc:dd:ee:ff``, ``aabb.ccdd.eeff``, ``aabbcc-ddeeff``, none."""
_ADDRESS = re.compile(
    "|".join(
        rf"[0-9a-f]{{{2 * size}}}(?:{separator}[0-9a-f]{{{2 * size}}}){{{6 // size - 1}}}"
        for size in _OCTETS
        for separator in (":", "-", r"\.")
    )
)
_UUID = re.compile(r"([0-9a-f]{8})-?([0-9a-f]{4})-?([0-9a-f]{4})-?([0-9a-f]{4})-?([0-9a-f]{12})(-\d+-\d+)?")
_HASH_DIGITS = 32
"""A keyed hash that replaces an address has the digits of a UUID without dashes."""
MASKED = frozenset({"", "02:00:00:00:00:00", "00:00:00:00:00:00", "ff:ff:ff:ff:ff:ff"})
"""Values that are written for an unknown address, in the normal notation."""
NO_ADDRESS = (
    "Possible cause: without the location permission Android reports 02:00:00:00:00:00 for every address, and some "
    "recorders write zeros, ones or nothing for an unknown one. Grant the app the precise location permission and "
    "record again."
)


def normal_address(text: str) -> str:
    """Write an address in lower case with colons, a UUID in lower case with dashes; other names stay as they are.

    A UUID may be followed by an iBeacon's major and minor. 32 digits alone are kept: they may be a keyed hash.
    """
    name = text.strip()
    lower = name.lower()
    if _ADDRESS.fullmatch(lower):
        digits = re.sub(r"[:.-]", "", lower)
        return ":".join(digits[i : i + 2] for i in range(0, 12, 2))
    return name if len(lower) <= _HASH_DIGITS else _with_dashes(lower) or name


def normal_uuid(text: str) -> str:
    """Write a UUID in lower case with dashes, also if it is 32 digits; return anything else unchanged."""
    name = text.strip()
    return _with_dashes(name.lower()) or name


def is_address(text: str) -> bool:
    """Whether a text is an address in any notation."""
    return _ADDRESS.fullmatch(text.strip().lower()) is not None


def is_masked(text: str) -> bool:
    """Whether a name, in any notation, is a placeholder for an unknown address."""
    return normal_address(text) in MASKED


def _with_dashes(lower: str) -> str | None:
    found = _UUID.fullmatch(lower)
    if found is None:
        return None
    return "-".join(found.groups()[:5]) + (found[6] or "")


def normal_addresses(column: pl.Series) -> pl.Series:
    """:func:`normal_address` of each name; null stays null."""
    return _in_normal_form(column, normal_address)


def normal_uuids(column: pl.Series) -> pl.Series:
    """:func:`normal_uuid` of each text; null stays null."""
    return _in_normal_form(column, normal_uuid)


def _in_normal_form(column: pl.Series, form: Callable[[str], str]) -> pl.Series:
    changed = {name: new for name in column.unique().drop_nulls() if (new := form(name)) != name}
    return column.replace(old=changed) if changed else column


def with_addresses(
    rows: pl.DataFrame, column: str, file: str, known: pl.Expr | None = None
) -> tuple[pl.DataFrame, list[Finding]]:
    """Normalise a column of addresses, skip rows without an address, and report them.

    Column ``row`` is the line of a row. Rows that are ``known`` by something else than their address are kept.
    """
    named = rows.with_columns(normal_addresses(rows[column]))
    masked = pl.col(column).is_null() | pl.col(column).is_in(list(MASKED))
    gone = masked if known is None else masked & ~known
    left_out = named.filter(gone)
    if left_out.is_empty():
        return named, []
    names = left_out[column].fill_null("").unique().to_list()
    return named.filter(~gone), [masked_addresses(file, left_out["row"].to_list(), names)]


def masked_addresses(file: str, lines: list[int], names: list[str]) -> Finding:
    """Report lines that are skipped because their names are placeholders for unknown addresses."""
    found = ", ".join(name or "an empty field" for name in sorted(names))
    verb = "is not an address" if len(names) == 1 else "are not addresses"
    message = f"{found} {verb}; these rows are skipped. {NO_ADDRESS}"
    return Finding.at_lines("masked_addresses", file, lines, message)


_NEARLY_ALL = 0.9


def are_exchanged(addresses: pl.Series, names: pl.Series) -> bool:
    """Whether nearly all network names (n,) are addresses, and nearly no address (n,) is one."""
    return _addresses_among(names) >= _NEARLY_ALL and _addresses_among(addresses) <= 1 - _NEARLY_ALL


def address_fault(bssids: Sequence[str], ssids: Sequence[str], known: Sequence[str]) -> str | None:
    """Say what is wrong with columns bssid (n,) and ssid (n,); None if they may be right for the ``known`` names.

    They are exchanged, or nearly no ``bssid`` is an address, although nearly all known names are.
    """
    addresses, names, wanted = (pl.Series(each, dtype=pl.String) for each in (bssids, ssids, known))
    if are_exchanged(addresses, names):
        return "the columns bssid and ssid are exchanged; exchange their names"
    if not len(addresses) or _addresses_among(wanted) < _NEARLY_ALL or _addresses_among(addresses) > 1 - _NEARLY_ALL:
        return None
    example = next(name for name in wanted if is_address(name))
    return (
        f"column bssid contains names such as '{addresses[0]}', not addresses such as {example}: use the column of "
        "addresses"
    )


def _addresses_among(names: pl.Series) -> float:
    known = [name for name in names.unique().drop_nulls() if is_address(name)]
    return int(names.is_in(known).sum()) / max(len(names), 1)


def with_columns_in_place(rows: pl.DataFrame, file: str) -> tuple[pl.DataFrame, list[Finding]]:
    """Exchange the columns ``bssid`` and ``ssid`` if their contents are exchanged, and report that."""
    if not {"bssid", "ssid"} <= set(rows.columns) or not are_exchanged(rows["bssid"], rows["ssid"]):
        return rows, []
    message = (
        "network names (SSID) are addresses, and addresses (BSSID) are not: the columns are exchanged; they are read "
        "the other way round. Correct the file"
    )
    finding = Finding(kind="exchanged_columns", file=file, count=rows.height, message=message)
    return rows.with_columns(bssid="ssid", ssid="bssid"), [finding]


KINDS = frozenset(
    {
        "absurd_levels",
        "exchanged_columns",
        "levels_not_dbm",
        "lost_sign",
        "masked_addresses",
        "stale_scans",
        "unstated_filler",
    }
)
"""Kinds of findings about readings."""


def admitted(
    rows: pl.DataFrame, sender: str, file: str, known: pl.Expr | None = None
) -> tuple[pl.DataFrame, list[Finding]]:
    """Admit readings (``row``, ``rssi_dbm`` and the column ``sender`` of addresses) and report what is odd.

    Columns ``bssid`` and ``ssid`` that are exchanged are read the other way round. Rows without an address are skipped,
    except those that are ``known`` by something else; levels out of range become null.
    """
    in_place, exchanged = with_columns_in_place(rows, file)
    named, masked = with_addresses(in_place, sender, file, known)
    heard, fillers = without_filler(named, sender, file)
    kept, absurd = without_absurd_levels(heard, file)
    return kept, [*exchanged, *masked, *fillers, *absurd]


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
    weakest = others and level < min(other for other, _ in others)
    if not weakest or cells < max(_MIN_CELLS, _MORE_FREQUENT * others[0][1]):
        return rows, []
    nearest = min(other for other, _ in others)
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
