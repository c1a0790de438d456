"""Locates scans with a saved model, some thousand at a time."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path

import numpy as np
import polars as pl

from vislam2tag.common.errors import DatasetError, UsageError
from vislam2tag.common.files.given_files import AnyPath
from vislam2tag.common.findings import Answer, Finding, Judgement, counted
from vislam2tag.common.tabular import Frames, TabularResult
from vislam2tag.core.arrays import IntArray
from vislam2tag.datasets.folder import dataset_in, is_dataset, open_dataset
from vislam2tag.datasets.model import SessionTables, each_session
from vislam2tag.datasets.privacy import hashed, hashed_as_written, key_name
from vislam2tag.datasets.technologies import instead_of, of_technology, technologies_of
from vislam2tag.intake.readings import normal_address
from vislam2tag.pipeline.positioning.recorded_scans import RecordedScans, recorded_scans
from vislam2tag.positioning.model_files import ModelOrigin, SavedModel, load_model
from vislam2tag.positioning.places import Positions
from vislam2tag.positioning.radio_scans import RadioScans, TextArray, scans_from_readings
from vislam2tag.positioning.scan_file import SCANS_AT_ONCE, BadLines, ScanBlock, is_scan_file, scan_blocks
from vislam2tag.positioning.sequences import filtered, smoothed
from vislam2tag.positioning.settings import SequenceMethod
from vislam2tag.positioning.tracks import Tracks

OK, UNLIKE, UNKNOWN = "ok", "unlike", "unknown"
LOCATED = {
    "scan_id": pl.String,
    "status": pl.String,
    "building": pl.String,
    "floor": pl.Int64,
    "floor_name": pl.String,
    "room": pl.String,
    "x": pl.Float64,
    "y": pl.Float64,
    "z": pl.Float64,
    "radius_68_m": pl.Float64,
    "radius_95_m": pl.Float64,
    "floor_probability": pl.Float64,
}
"""Columns: BCS metres; null if the status is ``unknown``; ``z`` if no height was learned;
``building``, ``floor_name`` and ``room`` if they have no name. ``unlike``: the scan is unlike all training data."""
_DECIMALS = 3
Write = Callable[[str], object]
_NAMES_KEPT = 100_000
"""Size of the cache of access point names."""


def located_table(ids: TextArray, found: Positions, origin: ModelOrigin) -> pl.DataFrame:
    """Make rows of scans with these ids (n,) and positions (n); ``origin`` names floors. Numbers are rounded to mm."""
    storey = np.maximum(found.storey, 0)
    numbers = {
        "x": found.xy[:, 0],
        "y": found.xy[:, 1],
        "z": found.z,
        "radius_68_m": found.radius_68_m,
        "radius_95_m": found.radius_95_m,
        "floor_probability": np.take_along_axis(found.storey_probability, storey[:, None], axis=1)[:, 0],
    }
    like = np.where(False if found.unlike is None else found.unlike, UNLIKE, OK)
    columns = {
        "scan_id": ids.tolist(),
        "status": np.where(found.known, like, UNKNOWN).tolist(),
        "building": [found.storeys[index].building or None for index in storey.tolist()],
        "floor": found.floor,
        "floor_name": [origin.floor_name(found.storeys[index]) or None for index in storey.tolist()],
        "room": _rooms(found, storey, origin),
    }
    unknown = pl.col("status") == UNKNOWN
    return pl.DataFrame(columns | numbers, schema=LOCATED).with_columns(
        pl.when(~unknown).then(pl.col("building", "floor", "floor_name", "room")),
        pl.col(*numbers).round(_DECIMALS).fill_nan(None),
    )


def _rooms(found: Positions, storey: IntArray, origin: ModelOrigin) -> list[str | None]:
    """The room of each position (n); ``storey`` (n,) are the places of their floors."""
    rooms: list[str | None] = [None] * len(storey)
    for index in np.unique(storey).tolist():
        rows = np.flatnonzero(storey == index)
        for row, name in zip(rows.tolist(), origin.rooms_at(found.storeys[index], found.xy[rows]), strict=True):
            rooms[row] = name or None
    return rooms


@dataclass(frozen=True, repr=False)
class LocatedScans(TabularResult):
    """Counts of scans by result, and their positions unless they were written."""

    scans: int
    unknown: int
    unlike: int
    """Scans that are unlike all training data."""
    access_points: int
    """Number of access points that the model knows."""
    findings: tuple[Finding, ...]
    advice: str | None
    """Advice on hashed identifiers, if it applies."""
    in_walks: int = 0
    """Scans that were located together with others of their walk."""
    tracked: int = 0
    """Of those, scans with motion from a track."""
    without_wifi: int = 0
    """Scans without a known Wi-Fi access point, if the model was trained on Wi-Fi and BLE together."""
    without_ble: int = 0
    """Scans without a known BLE beacon, if the model was trained on Wi-Fi and BLE together."""
    usable: int = 0
    """Scans with at least one usable reading."""
    positions: pl.DataFrame | None = None
    """A row for each scan with the columns :data:`LOCATED`; None if they were written."""

    def table_names(self) -> tuple[str, ...]:
        """Names of the tables: ``positions``, unless they were written, and ``summary``."""
        return tuple(self._frames())

    def to_frame(self, table: str | None = None) -> pl.DataFrame:
        """Return the positions, or the table named; raises UsageError for an unknown name."""
        return super().to_frame(table or self.table_names()[0])

    def _frames(self) -> Frames:
        positions = self.positions
        return super()._frames() if positions is None else {"positions": lambda: positions, **super()._frames()}

    @property
    def located(self) -> int:
        """Number of scans with a position."""
        return self.scans - self.unknown

    @property
    def judgement(self) -> Judgement:
        """Whether any scan got a position, and if not, why."""
        if self.located:
            return Judgement(answer=Answer.NOTHING_WRONG, looked_at=f"{self.located} of {counted(self.scans, 'scan')}")
        if self.usable:
            why = f"no scan contains any of the model's {counted(self.access_points, 'access point')}"
        elif self.findings:
            why = "no line is usable"
        else:
            why = "the input contains no scan"
        return Judgement(answer=Answer.NOT_JUDGED, why=why)


@dataclass(frozen=True)
class WalkPlan:
    """How scans of a walk are located together."""

    sequence: SequenceMethod
    tracks: Tracks | None = None


class _WalkEstimation:
    """Filters or smooths block after block; every walk is within one block."""

    def __init__(self, plan: WalkPlan | None) -> None:
        self.plan = plan
        self.scans = self.tracked = 0
        self._ended: set[str] = set()

    def helped(self, found: Positions, block: ScanBlock) -> Positions:
        """Return positions filtered over the walk, or unchanged without such a plan."""
        if self.plan is None:
            return found
        scans = block.scans
        walks = {str(name) for name in np.unique(scans.session)} - {""}
        if not walks and not self._ended:
            raise UsageError("--sequence and --track need the columns session and time_ns; add both to the scans")
        if again := walks & self._ended:
            raise DatasetError(
                f"scans of session {min(again)} are not consecutive; sort the scans by session and time_ns"
            )
        self._ended |= walks
        track_m = None if self.plan.tracks is None else self.plan.tracks.at(scans)
        self.scans += int((scans.session != "").sum())
        self.tracked += 0 if track_m is None else int(np.isfinite(track_m).all(axis=1).sum())
        return (smoothed if self.plan.sequence is SequenceMethod.SMOOTHER else filtered)(found, scans, track_m)


def locate(
    model: AnyPath,
    scans: AnyPath,
    write: Write | None = None,
    *,
    as_json: bool = False,
    key: bytes | None = None,
    walks: WalkPlan | None = None,
) -> LocatedScans:
    """Locate the scans of a file, a data set or a recording; ``write`` gets CSV or JSON lines, block by block.

    Without ``write``, the result has the positions: ``locate(model, scans).to_pandas()``.

    A recording is a session folder or a Wi-Fi file as a phone or an app wrote it. Its poses are its track, unless
    ``walks`` name another.

    ``key`` hashes identifiers as those of the model's data set were. With ``walks``, scans of a session are located
    together. Raises ModelError for the model's file, DatasetError for scans and tracks, UsageError if their hashing
    differs, or if ``walks`` need sessions and scans have none.
    """
    model, scans = Path(model), Path(scans)
    saved = load_model(model)
    _check_key(saved, key)
    bad = BadLines(scans.name)
    name = namer(saved, key)
    blocks: Iterable[ScanBlock]
    recorded_findings: tuple[Finding, ...] = ()
    of_dataset = is_dataset(dataset_in(scans))
    if of_dataset:
        blocks = _dataset_blocks(scans, saved, key, name, whole=walks is not None)
    elif scans.exists() and not is_scan_file(scans):
        recorded = recorded_scans(scans, saved.origin, name)
        blocks, recorded_findings = [recorded.block], recorded.findings
        walks = _with_track(walks, recorded)
    else:
        blocks = scan_blocks(scans, bad, name, saved.model.access_points_)
    helping = _WalkEstimation(walks)
    kept = [pl.DataFrame(schema=LOCATED)]
    head = "" if as_json else ",".join(LOCATED) + "\n"
    count = unknown = unlike = usable = without_wifi = without_ble = 0
    for block in blocks:
        found = helping.helped(saved.model.predict(block.scans), block)
        count, unknown = count + len(found), unknown + int((~found.known).sum())
        usable += int(np.count_nonzero(block.scans.heard))
        missing = missing_technologies(block.scans, saved)
        without_wifi, without_ble = without_wifi + missing[0], without_ble + missing[1]
        rows = located_table(block.ids, found, saved.origin)
        unlike += int((rows["status"] == UNLIKE).sum())
        if write is None:
            kept.append(rows)
            continue
        write(head + (rows.write_ndjson() if as_json else rows.write_csv(include_header=False)))
        head = ""  # written with the first scans, so that a file without any is refused before
    if write is not None:
        write(head)
    advice = None if key is not None or of_dataset else hashing_advice(saved)
    points = len(saved.model.access_points_)
    return LocatedScans(
        count,
        unknown,
        unlike,
        points,
        (*bad.findings(), *recorded_findings),
        advice,
        helping.scans,
        helping.tracked,
        without_wifi,
        without_ble,
        usable,
        None if write is not None else pl.concat(kept),
    )


def _with_track(walks: WalkPlan | None, recorded: RecordedScans) -> WalkPlan | None:
    """Use a recording's own poses, unless another track was given; raises DatasetError if that is of other walks."""
    if walks is not None and walks.tracks is not None:
        walks.tracks.refuse_without(recorded.block.scans)
        return walks
    if recorded.track is None:
        return walks
    return WalkPlan(SequenceMethod.SMOOTHER if walks is None else walks.sequence, recorded.track)


def missing_technologies(scans: RadioScans, saved: SavedModel) -> tuple[int, int]:
    """Scans without Wi-Fi and without BLE, of those that contain a known access point; zero for other models."""
    if not saved.origin.beacons:
        return 0, 0
    known = set(saved.model.access_points_)
    beacons = known & set(saved.origin.beacons)
    has = [np.zeros(len(scans), dtype=bool) for _ in range(2)]
    for names, found in zip((known - beacons, beacons), has, strict=True):
        of_them = np.array([point in names for point in scans.access_points], dtype=bool)
        found[scans.row[of_them[scans.column]]] = True
    wifi, ble = has
    return int((ble & ~wifi).sum()), int((wifi & ~ble).sum())


def missing_notes(without_wifi: int, without_ble: int) -> list[str]:
    """Messages about scans (counted) without one of the two technologies that the model was trained on together."""
    return [
        f"{counted(count, 'scan')} without a known {missing}: the model was trained on Wi-Fi and BLE together, so "
        "expect larger errors there"
        for count, missing in ((without_wifi, "Wi-Fi access point"), (without_ble, "BLE beacon"))
        if count
    ]


def hashing_advice(saved: SavedModel) -> str | None:
    """Say how scans must be hashed for this model; None if its access points are plain."""
    if saved.origin.bssid_key is None:
        return None
    return (
        f"the model's access points are hashed with key {saved.origin.bssid_key}: use --hash-bssid KEYFILE, or scans "
        "with bssid as the first 32 hex digits of HMAC-SHA256(key, address in lower case with colons)"
    )


def _check_key(saved: SavedModel, key: bytes | None) -> None:
    if key is None:
        return
    if saved.origin.bssid_key is None:
        raise UsageError("--hash-bssid: the model's access points have plain identifiers; remove this option")
    if key_name(key) != saved.origin.bssid_key:
        raise UsageError(
            f"--hash-bssid: the model's data set was hashed with key {saved.origin.bssid_key}, but the file contains "
            f"key {key_name(key)}"
        )


def namer(saved: SavedModel, key: bytes | None) -> Callable[[str], str]:
    """Return a function from an identifier, in any notation and case, to its name in the model."""
    points = saved.model.access_points_
    known = {normal_address(point).lower(): point for point in reversed(points)} | {point: point for point in points}

    @lru_cache(_NAMES_KEPT)
    def name(identifier: str) -> str:
        if key is not None:
            code = hashed(identifier, key)
            return known.get(code, known.get(hashed_as_written(identifier, key), code))
        return known.get(identifier, known.get(normal_address(identifier).lower(), identifier))

    return name


def _dataset_blocks(
    folder: Path, saved: SavedModel, key: bytes | None, name: Callable[[str], str], *, whole: bool
) -> Iterator[ScanBlock]:
    """Read a data set's fingerprints of the model's technology, walk after walk (uncut if ``whole``)."""
    dataset = open_dataset(folder)
    technology = saved.origin.technology
    theirs, ours = dataset.info.bssid_key, saved.origin.bssid_key
    if theirs is not None and key is not None:
        raise UsageError(f"--hash-bssid: {dataset.info.name} is already hashed; remove this option")
    if key is None and theirs != ours:
        if theirs is None:
            raise UsageError(f"{dataset.info.name} contains plain identifiers, but {hashing_advice(saved)}")
        raise UsageError(
            f"{dataset.info.name} is hashed with key {theirs}, but the model's access points are "
            f"{'plain' if ours is None else f'hashed with key {ours}'}; use the original, unhashed data set"
        )
    wanted, readings = of_technology(dataset, technology)
    if wanted.select(pl.len()).collect().item() == 0 and technologies_of(dataset):
        raise DatasetError(
            f"{dataset.info.name}: the data set contains no fingerprint of technology {technology}, which the model "
            f"was trained on{instead_of(dataset, technology)}"
        )
    for session in each_session(wanted, readings):
        at_once = max(session.fingerprints.height, 1) if whole else SCANS_AT_ONCE
        for first in range(0, session.fingerprints.height, at_once):
            yield _block(session, session.fingerprints.slice(first, at_once), name)


def _block(session: SessionTables, fingerprints: pl.DataFrame, name: Callable[[str], str]) -> ScanBlock:
    rows = fingerprints.select("scan_id").with_row_index("row")
    readings = session.readings.join(rows, on="scan_id", how="inner", maintain_order="left")
    scans = scans_from_readings(
        readings["row"].to_numpy().astype(np.int64),
        np.array([name(one) for one in readings["bssid"]], dtype=np.str_),
        readings["rssi_dbm"].to_numpy().astype(np.float64),
        fingerprints.height,
        device=fingerprints["device"].fill_null("").to_numpy().astype(np.str_),
        session=np.full(fingerprints.height, session.session or ""),
        time_ns=fingerprints["start_ns"].fill_null(0).to_numpy(),
    )
    return ScanBlock(fingerprints["scan_id"].to_numpy().astype(np.str_), scans)
