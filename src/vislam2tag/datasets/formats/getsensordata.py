"""Logs of GetSensorData (CSIC), as the IPIN competitions publish them.

One text file for each walk, with places in degrees.
"""

from __future__ import annotations

import hashlib
import itertools
import math
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from vislam2tag import __version__
from vislam2tag.common.errors import DatasetError
from vislam2tag.common.files.archives import first_bytes_of_files, folder_of
from vislam2tag.common.files.given_files import read_bytes
from vislam2tag.common.findings import Finding
from vislam2tag.datasets.format_registry import ImportContext, ImportFormat, register
from vislam2tag.datasets.logged_walks import FARTHEST_M, LoggedWalk, Waypoints, walks_dataset
from vislam2tag.datasets.model import Dataset, DatasetInfo, DatasetSource, FloorInfo, Storey
from vislam2tag.sessions.formats.getsensordata import LoggedTaps, looks_like_a_log, parse_log, parse_taps
from vislam2tag.site.georeference import Georeference, from_wgs84
from vislam2tag.site.model import unique_slugs

ORIGIN_STEP_DEG = 1e-4
"""The default origin is the south-west corner of all taps, rounded down to this grid, about ten metres."""
_HEAD_BYTES = 65_536
_FILES_LOOKED_AT = 3


def recognises(path: Path) -> bool:
    """Whether one of the first text files has rows of the format."""
    if path.is_file() and path.suffix not in (".txt", ".log", ".zip", ".xz", ".gz", ".tgz", ".tar", ".bz2"):
        return False
    heads = itertools.islice(first_bytes_of_files(path, ".txt", _HEAD_BYTES), _FILES_LOOKED_AT)
    return any(looks_like_a_log(head) for head in heads)


def read(path: Path, context: ImportContext) -> Dataset:
    """Read all logs below a folder or in an archive, one at a time, in metres on the plane at the origin."""
    logs = _logs(path, folder_of(path, context.scratch, context.most_unpacked))
    taps = [parse_taps(_bytes(file)) for _, file in logs]
    centre = _centre(path, taps)
    near = [_near(each, centre) for each in taps]
    origin = _origin(near, context.origin)
    places = sorted({place for each in near for place in _places(each)})
    settings: dict[str, object] = {"origin": [origin.latitude_deg, origin.longitude_deg]}
    info = DatasetInfo(
        name=path.resolve().name.split(".")[0] or "getsensordata",
        title="GetSensorData logs",
        description="Walks between marked places; positions between them are interpolated at each reading's time.",
        frame="metres east (x) and north (y) of the origin",
        clock="boot",
        floors=tuple(FloorInfo(building=place.building, number=place.floor, georeference=origin) for place in places),
        sources=(DatasetSource(kind="getsensordata", name=path.name, version=__version__, settings=settings),),
    )
    return walks_dataset(context, info, places, logs, lambda log: _walk(*log, places, centre, origin))


def _logs(path: Path, folder: Path) -> list[tuple[str, Path]]:
    """Slugs and files of the logs, in order; other text files are ignored."""
    if path.is_file() and folder == path.parent:
        files = [path]
    else:
        files = [
            file
            for file in sorted(folder.rglob("*.txt"))
            if any(map(looks_like_a_log, first_bytes_of_files(file, "", _HEAD_BYTES)))
        ]
    if not files or not looks_like_a_log(_bytes(files[0])[:_HEAD_BYTES]):
        raise DatasetError(f"{path}: contains no log; expected lines such as WIFI;12.345;678.910;SSID;BSSID;RSS")
    names = [".".join(file.relative_to(folder).with_suffix("").parts) for file in files]
    return sorted(zip(unique_slugs(names), files, strict=True))


def _bytes(file: Path) -> bytes:
    try:
        return read_bytes(file)
    except OSError as error:
        raise DatasetError(f"{file}: cannot be read ({error.strerror})") from error


def _places(taps: LoggedTaps) -> list[Storey]:
    return [
        Storey(str(building), floor)
        for building, floor in zip(taps.building.tolist(), taps.floor.tolist(), strict=True)
    ]


def _centre(path: Path, taps: Sequence[LoggedTaps]) -> Georeference:
    """The tap nearest to the median of all; raises DatasetError without taps."""
    position = np.concatenate([each.position for each in taps])
    if not len(position):
        raise DatasetError(
            f"{path}: no log has a POSI row with a place, so nothing can be labelled. If you also recorded a walk with "
            "poses, attach the log to it: vislam2tag attach WALK LOG"
        )
    off = np.linalg.norm(position - np.median(position, axis=0), axis=1)
    longitude, latitude = position[np.argmin(off)].tolist()
    return Georeference(latitude_deg=latitude, longitude_deg=longitude)


def _near(taps: LoggedTaps, centre: Georeference) -> LoggedTaps:
    """Skip taps that are too far away to belong to the site."""
    near = np.linalg.norm(from_wgs84(taps.position, centre), axis=1) <= FARTHEST_M
    return LoggedTaps(taps.app_s[near], taps.position[near], taps.floor[near], taps.building[near], taps.time_ns[near])


def _origin(taps: Sequence[LoggedTaps], given: tuple[float, float] | None) -> Georeference:
    if given is not None:
        return Georeference(latitude_deg=given[0], longitude_deg=given[1])
    west, south = np.min(np.concatenate([each.position for each in taps]), axis=0).tolist()
    west, south = (round(math.floor(value / ORIGIN_STEP_DEG) * ORIGIN_STEP_DEG, 4) for value in (west, south))
    return Georeference(latitude_deg=south, longitude_deg=west)


def _walk(slug: str, file: Path, places: Sequence[Storey], centre: Georeference, origin: Georeference) -> LoggedWalk:
    data = _bytes(file)
    log = parse_log(data, file.name)
    taps = _near(log.taps, centre)
    index = np.array([places.index(place) for place in _places(taps)], dtype=np.int64)
    findings = list(log.findings)
    if far := len(log.taps.app_s) - len(taps.app_s):
        message = "POSI rows more than ten kilometres from the others are not used as taps"
        findings.append(Finding(kind="far_taps", file=file.name, count=far, message=message))
    return LoggedWalk(
        slug=slug,
        name=file.stem,
        place=None,
        device=log.device,
        taps=Waypoints.of(taps.time_ns, from_wgs84(taps.position, origin), index),
        tables=log.tables,
        first_ns=log.first_ns,
        last_ns=log.last_ns,
        started=log.started,
        source=hashlib.sha256(data).hexdigest(),
        file=slug,
        findings=findings,
    )


register(ImportFormat("getsensordata", read, recognises, takes=("origin",)))
