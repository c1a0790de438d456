"""Input rules for radio readings: notation of addresses, and numbers that are levels."""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Sequence

import polars as pl

from vislam2tag.common.findings import Finding
from vislam2tag.intake.cells import LEVEL_UNIT
from vislam2tag.intake.fillers import without_filler
from vislam2tag.intake.level_scales import SIGNAL_STRENGTH, LevelRange, other_levels


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
