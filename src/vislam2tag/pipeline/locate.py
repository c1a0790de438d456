"""Scans become positions by a saved model, some thousand at a time."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path

import numpy as np
import polars as pl

from vislam2tag.dataset.by_session import SessionTables, each_session
from vislam2tag.dataset.folder import is_dataset, open_dataset
from vislam2tag.dataset.transmitters.privacy import hashed, key_name
from vislam2tag.errors import UsageError
from vislam2tag.findings import Finding
from vislam2tag.positioning.located_table import LOCATED, located_table
from vislam2tag.positioning.model_file import SavedModel, load
from vislam2tag.positioning.scan_file import SCANS_AT_ONCE, BadLines, ScanBlock, scan_blocks
from vislam2tag.positioning.scans import scans_of

Write = Callable[[str], object]
_NAMES_KEPT = 100_000
"""Access points whose name in the model is remembered."""


@dataclass(frozen=True)
class Located:
    """What became of the scans."""

    scans: int
    unknown: int
    access_points: int
    """How many the model knows."""
    findings: tuple[Finding, ...]
    advice: str | None
    """What must be known of hashed identifiers, where it matters."""


def locate(model: Path, scans: Path, write: Write, *, as_json: bool, key: bytes | None = None) -> Located:
    """Locate the scans of a file or of a data set's folder; ``write`` gets CSV or JSON lines, block by block.

    ``key`` hashes identifiers as those of the model's data set were. Raises ModelError for the model's file,
    DatasetError for the scans, UsageError where one is hashed in another way than the other.
    """
    saved = load(model)
    _check_key(saved, key)
    bad = BadLines(scans.name)
    name = _namer(saved, key)
    blocks = _dataset_blocks(scans, saved, key, name) if is_dataset(scans) else scan_blocks(scans, bad, name)
    if not as_json:
        write(",".join(LOCATED) + "\n")
    count = unknown = 0
    for block in blocks:
        found = saved.model.predict(block.scans)
        count, unknown = count + len(found), unknown + int((~found.known).sum())
        rows = located_table(block.ids, found)
        write(rows.write_ndjson() if as_json else rows.write_csv(include_header=False))
    advice = None if key is not None or is_dataset(scans) else hashing_advice(saved)
    return Located(count, unknown, len(saved.model.access_points_), bad.findings(), advice)


def hashing_advice(saved: SavedModel) -> str | None:
    """Say how scans must be hashed for this model; None where its access points are plain."""
    if saved.origin.bssid_key is None:
        return None
    return (
        f"the model knows access points by their hash with key {saved.origin.bssid_key}: give --hash-bssid KEYFILE, or "
        "scans whose bssid is the first 32 hex digits of HMAC-SHA256(key, address in lower case)"
    )


def _check_key(saved: SavedModel, key: bytes | None) -> None:
    if key is None:
        return
    if saved.origin.bssid_key is None:
        raise UsageError("--hash-bssid: the model knows access points by their plain identifiers; leave it out")
    if key_name(key) != saved.origin.bssid_key:
        raise UsageError(
            f"--hash-bssid: the model's data set was hashed with key {saved.origin.bssid_key}, the file holds key "
            f"{key_name(key)}"
        )


def _namer(saved: SavedModel, key: bytes | None) -> Callable[[str], str]:
    """Return what makes the model's name of an identifier, whatever case it is written in."""
    points = saved.model.access_points_
    known = {point.lower(): point for point in points} | {point: point for point in points}

    @lru_cache(_NAMES_KEPT)
    def name(identifier: str) -> str:
        if key is not None:
            return hashed(identifier, key)
        return known.get(identifier, known.get(identifier.lower(), identifier))

    return name


def _dataset_blocks(
    folder: Path, saved: SavedModel, key: bytes | None, name: Callable[[str], str]
) -> Iterator[ScanBlock]:
    """Read a data set's fingerprints of the model's technology, walk after walk, whether labelled or not."""
    dataset = open_dataset(folder)
    theirs, ours = dataset.info.bssid_key, saved.origin.bssid_key
    if theirs is not None and key is not None:
        raise UsageError(f"--hash-bssid: {dataset.info.name} is hashed already; leave it out")
    if key is None and theirs != ours:
        if theirs is None:
            raise UsageError(f"{dataset.info.name} holds plain identifiers, but {hashing_advice(saved)}")
        raise UsageError(
            f"{dataset.info.name} is hashed with key {theirs}, the model's access points are "
            f"{'plain' if ours is None else f'hashed with key {ours}'}; use the set that it was hashed from"
        )
    wanted = dataset.fingerprints.filter(pl.col("technology") == saved.origin.technology)
    for session in each_session(wanted, dataset.readings):
        for first in range(0, session.fingerprints.height, SCANS_AT_ONCE):
            yield _block(session, session.fingerprints.slice(first, SCANS_AT_ONCE), name)


def _block(session: SessionTables, fingerprints: pl.DataFrame, name: Callable[[str], str]) -> ScanBlock:
    rows = fingerprints.select("scan_id").with_row_index("row")
    readings = session.readings.join(rows, on="scan_id", how="inner", maintain_order="left")
    scans = scans_of(
        readings["row"].to_numpy().astype(np.int64),
        np.array([name(one) for one in readings["bssid"]], dtype=np.str_),
        readings["rssi_dbm"].to_numpy().astype(np.float64),
        fingerprints.height,
        device=fingerprints["device"].fill_null("").to_numpy().astype(np.str_),
        session=np.full(fingerprints.height, session.session),
        time_ns=fingerprints["start_ns"].fill_null(0).to_numpy(),
    )
    return ScanBlock(fingerprints["scan_id"].to_numpy().astype(np.str_), scans)
