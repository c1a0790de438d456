"""The one notation of addresses and UUIDs: lower case, octets apart by colons; and what is no address at all."""

from __future__ import annotations

import re

import polars as pl

from vislam2tag.common.findings import Finding

_OCTETS = (1, 2, 3, 6)
"""Octets that a group between separators has: ``aa:bb:cc:dd:ee:ff``, ``aabb.ccdd.eeff``, ``aabbcc-ddeeff``, none."""
_ADDRESS = re.compile(
    "|".join(
        rf"[0-9a-f]{{{2 * size}}}(?:{separator}[0-9a-f]{{{2 * size}}}){{{6 // size - 1}}}"
        for size in _OCTETS
        for separator in (":", "-", r"\.")
    )
)
_UUID = re.compile(r"([0-9a-f]{8})-?([0-9a-f]{4})-?([0-9a-f]{4})-?([0-9a-f]{4})-?([0-9a-f]{12})(-\d+-\d+)?")
_HASH_DIGITS = 32
"""A keyed hash in place of an address has the digits of a UUID without dashes."""
MASKED = frozenset({"", "02:00:00:00:00:00", "00:00:00:00:00:00", "ff:ff:ff:ff:ff:ff"})
"""What is written where an address is not known, in the one notation."""
NO_ADDRESS = (
    "Possible cause: Android gives an app without the location permission 02:00:00:00:00:00 in place of every address; "
    "recorders write zeros, ones or nothing for an unknown one. Grant the app the permission (precise location) "
    "and record again."
)


def normal_address(text: str) -> str:
    """Write an address in lower case with colons, a UUID in lower case with dashes; other names stay as they are.

    A UUID may be followed by an iBeacon's major and minor. 32 digits alone stay: they may be a keyed hash.
    """
    name = text.strip()
    lower = name.lower()
    if _ADDRESS.fullmatch(lower):
        digits = re.sub(r"[:.-]", "", lower)
        return ":".join(digits[i : i + 2] for i in range(0, 12, 2))
    return name if len(lower) <= _HASH_DIGITS else _with_dashes(lower) or name


def normal_uuid(text: str) -> str:
    """Write a UUID in lower case with dashes, from 32 digits, too; anything else stays as it is."""
    name = text.strip()
    return _with_dashes(name.lower()) or name


def is_masked(text: str) -> bool:
    """Whether a name in any notation stands for an address that is not known."""
    return normal_address(text) in MASKED


def _with_dashes(lower: str) -> str | None:
    found = _UUID.fullmatch(lower)
    if found is None:
        return None
    return "-".join(found.groups()[:5]) + (found[6] or "")


def normal_addresses(column: pl.Series) -> pl.Series:
    """:func:`normal_address` of each name; null stays null."""
    names = column.unique().drop_nulls()
    changed = {name: new for name in names if (new := normal_address(name)) != name}
    return column.replace(old=changed) if changed else column


def normal_uuids(column: pl.Series) -> pl.Series:
    """:func:`normal_uuid` of each text; null stays null."""
    names = column.unique().drop_nulls()
    changed = {name: new for name in names if (new := normal_uuid(name)) != name}
    return column.replace(old=changed) if changed else column


def with_addresses(
    rows: pl.DataFrame, column: str, file: str, known: pl.Expr | None = None
) -> tuple[pl.DataFrame, list[Finding]]:
    """Bring a column of addresses to the one notation; leave rows out that name none, and report them.

    Rows have their line as ``row``; those that are ``known`` by something else than their address stay.
    """
    named = rows.with_columns(normal_addresses(rows[column]))
    masked = pl.col(column).is_null() | pl.col(column).is_in(list(MASKED))
    left_out = named.select("row", column, out=masked if known is None else masked & ~known).filter("out")
    if left_out.is_empty():
        return named, []
    kept = named.filter(~masked if known is None else ~masked | known)
    return kept, [masked_addresses(file, left_out["row"].to_list(), left_out[column].fill_null("").unique().to_list())]


def masked_addresses(file: str, lines: list[int], names: list[str]) -> Finding:
    """Report lines that are left out because their names stand for addresses that are not known."""
    found = ", ".join(name or "an empty field" for name in sorted(names))
    verb = "is no address" if len(names) == 1 else "are no addresses"
    message = f"{found} {verb}; these rows are left out. {NO_ADDRESS}"
    return Finding.at_lines("masked_addresses", file, lines, message)
