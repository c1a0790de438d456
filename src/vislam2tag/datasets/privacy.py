"""Privacy of published data sets: networks that opted out, addresses and names.

Hashing hides an address from everyone without the key. It does not hide the place: someone who knows the position of an
access point can identify it by its signal (docs/how-to/publish.md).
"""

from __future__ import annotations

import hashlib
import hmac
from dataclasses import dataclass, replace
from pathlib import Path

import polars as pl

from vislam2tag.common.errors import UsageError
from vislam2tag.common.files.given_files import read_bytes
from vislam2tag.common.findings import Finding, FindingKind, Severity
from vislam2tag.datasets.model import Dataset
from vislam2tag.datasets.schema import ACCESS_POINTS, FINGERPRINTS, OF_ACCESS_POINTS
from vislam2tag.intake.readings import normal_address

LEAST_KEY_BYTES = 16
"""Shorter keys can be found by trial."""
NOMAP_LEFT_OUT: FindingKind = "nomap_left_out"
_HASH_DIGITS = 32
"""Hex digits of a hash: 128 bits, so that no two access points share one; it does not look like an address."""
_KEY_NAME_DIGITS = 16


@dataclass(frozen=True)
class Privacy:
    """What to remove or hide in a data set."""

    include_nomap: bool = False
    """Keep networks with a name that ends in ``_nomap``, by which owners ask not to be mapped."""
    hash_key: bytes | None = None
    """Replace identifiers by their HMAC-SHA256 with this key; the same key gives the same hash in every data set."""
    keep_ssids: bool = True


def read_key(path: Path) -> bytes:
    """Read a key from a file, without white space around it.

    Raises UsageError if the file cannot be read or the key is too short.
    """
    try:
        key = read_bytes(path).strip()
    except OSError as error:
        raise UsageError(f"{path}: the key cannot be read ({error.strerror})") from error
    if len(key) < LEAST_KEY_BYTES:
        raise UsageError(
            f"{path}: the key has {len(key)} bytes, but at least {LEAST_KEY_BYTES} are needed; make one, for example "
            f"with `openssl rand -hex 32 > {path.name}`, and keep it secret"
        )
    return key


def hashed(identifier: str, key: bytes) -> str:
    """Hash an access point's identifier (HMAC-SHA256, RFC 2104): 32 hex digits, the same for all notations."""
    return hashed_as_written(normal_address(identifier), key)


def hashed_as_written(identifier: str, key: bytes) -> str:
    """Hash as version 0.2 did: upper and lower case are the same, other notations are not."""
    return hmac.new(key, identifier.lower().encode(), hashlib.sha256).hexdigest()[:_HASH_DIGITS]


def key_name(key: bytes) -> str:
    """Name a key without revealing it, so that data sets hashed with different keys are not joined."""
    return hmac.new(key, b"name of this key", hashlib.sha256).hexdigest()[:_KEY_NAME_DIGITS]


def with_privacy(dataset: Dataset, privacy: Privacy) -> Dataset:
    """Remove and hide data as ``privacy`` says; tables stay lazy except that of the access points.

    Fingerprints keep their positions, and their readings are counted again. A finding counts the removed readings. The
    table of access points must list all that were heard, as in every data set, because hashing uses it.

    Raises UsageError if identifiers to be hashed are already hashed.
    """
    if privacy.hash_key is not None and dataset.info.bssid_key is not None:
        raise UsageError(
            f"data set {dataset.info.name}: the BSSIDs are already hashed; hash those of the original data set"
        )
    points = dataset.access_points.collect()
    if not privacy.include_nomap:
        dataset, points = _without_nomap(dataset, points)
    if privacy.hash_key is not None:
        dataset, points = _with_hashes(dataset, points, privacy.hash_key)
    if not privacy.keep_ssids:
        points = points.with_columns(ssid=pl.lit(None, pl.String))
    return replace(dataset, tables={**dataset.tables, ACCESS_POINTS: points.lazy()})


def _without_nomap(dataset: Dataset, points: pl.DataFrame) -> tuple[Dataset, pl.DataFrame]:
    unwanted = points.filter(pl.col("nomap").fill_null(False))
    if unwanted.is_empty():
        return dataset, points
    names = unwanted.select("bssid").lazy()
    out = dataset.readings.join(names, on="bssid", how="semi")
    heard = {
        name: dataset.tables[name].join(names, on="bssid", how="anti", maintain_order="left")
        for name in OF_ACCESS_POINTS
        if name in dataset.tables
    }
    tables = {**dataset.tables, **heard, FINGERPRINTS: counted_without(dataset.fingerprints, out)}
    left = points.join(unwanted, on="bssid", how="anti", maintain_order="left")
    # A radio is named by an address, which must not be a removed one.
    left = left.with_columns(radio=pl.when(pl.col("radio").is_not_null()).then(pl.col("bssid").min().over("radio")))
    readings = int(unwanted["readings"].sum())
    message = (
        f"{readings} readings of {unwanted.height} networks are skipped, because their names end in _nomap: their "
        "owners ask not to be mapped"
    )
    finding = Finding(kind=NOMAP_LEFT_OUT, file="", count=readings, message=message, severity=Severity.INFO)
    info = dataset.info.model_copy(update={"findings": (*dataset.info.findings, finding)})
    return replace(dataset, info=info, tables=tables), left


def counted_without(fingerprints: pl.LazyFrame, out: pl.LazyFrame) -> pl.LazyFrame:
    """Subtract removed readings from the counts of their fingerprints."""
    gone = out.group_by("scan_id").agg(gone=pl.len().cast(pl.Int32), gone_labelled=pl.col("x").count().cast(pl.Int32))
    share = pl.when(pl.col("readings") > 0).then(pl.col("labelled") / pl.col("readings")).otherwise(0.0)
    return (
        fingerprints.join(gone, on="scan_id", how="left", maintain_order="left")
        .with_columns(
            readings=pl.col("readings") - pl.col("gone").fill_null(0),
            labelled=pl.col("labelled") - pl.col("gone_labelled").fill_null(0),
        )
        .with_columns(labelled_share=pl.when(pl.col("gone") > 0).then(share).otherwise("labelled_share"))
        .drop("gone", "gone_labelled")
    )


def _with_hashes(dataset: Dataset, points: pl.DataFrame, key: bytes) -> tuple[Dataset, pl.DataFrame]:
    """Replace identifiers and sort the table again, because the old order would reveal neighbouring addresses."""
    codes = pl.DataFrame(
        {"bssid": points["bssid"], "code": [hashed(bssid, key) for bssid in points["bssid"]]},
        schema={"bssid": pl.String, "code": pl.String},
    )
    coded = {
        name: dataset.tables[name]
        .join(codes.lazy(), on="bssid", how="inner", maintain_order="left")
        .with_columns(bssid="code")
        .drop("code")
        for name in OF_ACCESS_POINTS
        if name in dataset.tables
    }
    table = points.join(codes, on="bssid", how="left").join(
        codes.rename({"bssid": "radio", "code": "radio_code"}), on="radio", how="left"
    )
    hidden = table.with_columns(bssid="code", radio="radio_code").select(points.columns).sort("bssid")
    info = dataset.info.model_copy(update={"bssid_key": key_name(key)})
    return replace(dataset, info=info, tables={**dataset.tables, **coded}), hidden
