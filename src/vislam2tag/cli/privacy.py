"""The options of commands that give a data set away: what it should not tell."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, TypeAlias

import typer

from vislam2tag.dataset.transmitters.privacy import LEAST_KEY_BYTES, Privacy, read_key

IncludeNomap: TypeAlias = Annotated[
    bool,
    typer.Option(
        "--include-nomap", help="Keep networks named ..._nomap; they are left out otherwise, as their owners ask."
    ),
]
HashBssid: TypeAlias = Annotated[
    Path | None,
    typer.Option(
        metavar="KEYFILE",
        help=f"Replace BSSIDs by keyed hashes; the file holds a secret of at least {LEAST_KEY_BYTES} bytes. "
        "Sets hashed with one key can be joined.",
    ),
]
NoSsid: TypeAlias = Annotated[bool, typer.Option("--no-ssid", help="Leave the names of networks out.")]


def privacy_of(include_nomap: bool, hash_bssid: Path | None, no_ssid: bool) -> Privacy:
    """Make the wish of these options' values; raises UsageError for a key that cannot be used."""
    key = None if hash_bssid is None else read_key(hash_bssid)
    return Privacy(include_nomap=include_nomap, hash_key=key, keep_ssids=not no_ssid)
