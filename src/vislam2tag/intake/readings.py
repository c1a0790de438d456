"""Radio readings at the door: addresses in one notation, and levels that can be true."""

from __future__ import annotations

import polars as pl

from vislam2tag.common.findings import Finding
from vislam2tag.intake.addresses import with_addresses
from vislam2tag.intake.signal_strength import without_absurd_levels

KINDS = frozenset({"absurd_levels", "lost_sign", "masked_addresses"})
"""Of the findings about them."""


def admitted(
    rows: pl.DataFrame, sender: str, file: str, known: pl.Expr | None = None
) -> tuple[pl.DataFrame, list[Finding]]:
    """Admit readings (``row``, ``rssi_dbm`` and the column ``sender`` of addresses) and report what is odd.

    Rows without an address are left out, except those that are ``known`` by something else; levels out of range become
    null.
    """
    named, masked = with_addresses(rows, sender, file, known)
    kept, absurd = without_absurd_levels(named, file)
    return kept, [*masked, *absurd]
