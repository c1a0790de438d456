"""``process --together`` where walks go far without a landmark: others' radio scans say where they were.

Each session of such a floor is mapped once with what is told of landmarks; where it led and what it heard is all that
is kept (:mod:`vislam2tag.positioning.walk_ties`).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import polars as pl

from vislam2tag.common.errors import SessionError
from vislam2tag.core.context import PlaceTies
from vislam2tag.estimation.landmark_priors import LandmarkPriors
from vislam2tag.estimation.settings import MappingSettings
from vislam2tag.estimation.strategy import strategy_named
from vislam2tag.pipeline.run.failures import unexpected
from vislam2tag.positioning.places import calibration_rows
from vislam2tag.positioning.radio_scans import RadioScans, scans_of_walk
from vislam2tag.positioning.walk_traces import WalkTrace
from vislam2tag.sessions.prepared import SessionTask, mappable_session
from vislam2tag.site.model import SessionKey

MOST_KEPT = 256
"""Scans of a session, evenly spread: no more of it are asked."""


@dataclass(frozen=True)
class HeardWalk:
    """Where a session led, and what it heard on the way; without both it neither tells nor is told anything."""

    key: SessionKey
    trace: WalkTrace | None = None
    scans: RadioScans | None = None
    error: str | None = None


def heard_walk(strategy: str, settings: MappingSettings, task: SessionTask) -> HeardWalk:
    """Read and map a session for what it tells others; what ends it stands in its error."""
    key = task.ref.key
    try:
        prepared = mappable_session(task)
        camera, log, wifi = prepared.session.camera, prepared.session.landmarks, prepared.session.tables.get("wifi")
        if wifi is None or camera.without_poses:
            return HeardWalk(key)
        mapped = strategy_named(strategy, settings).map(camera, log, prepared.landmarks)
        trace = WalkTrace.of(mapped, key.floor, LandmarkPriors.of(log.ids, prepared.landmarks))
        return HeardWalk(key, trace, scans_of(key.device, wifi))
    except SessionError as error:
        return HeardWalk(key, error=str(error))
    except Exception as error:  # one bad session must not end the batch; its result names the fault
        return HeardWalk(key, error=unexpected(key, error))


def scans_of(device: str, wifi: pl.DataFrame) -> RadioScans:
    """The scans of a session's table of readings, each at the mean time of these; no more than are kept."""
    table = wifi.filter(~pl.col("repeated"))
    scans = scans_of_walk(
        table["scan"].to_numpy(),
        table["bssid"].to_numpy().astype(np.str_),
        table["rssi_dbm"].to_numpy().astype(np.float64),
        table["time_ns"].to_numpy().astype(np.int64),
        device,
    )
    return scans[calibration_rows(len(scans), MOST_KEPT)]


def ties_of(walks: Sequence[HeardWalk]) -> dict[SessionKey, PlaceTies]:
    """What each walk of a floor is told of where it was, rounded; of those that are told something."""
    from vislam2tag.positioning.walk_ties import radio_ties  # SciPy, which workers alone need otherwise
    from vislam2tag.positioning.walk_traces import rounded

    known = sorted((walk for walk in walks if walk.trace is not None and walk.scans), key=lambda walk: walk.key)
    told = radio_ties([walk.trace for walk in known], [walk.scans for walk in known if walk.scans])
    return {walk.key: rounded(ties) for walk, ties in zip(known, told, strict=True) if ties is not None}
