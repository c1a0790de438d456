"""What a model learned and a later survey, joined: of the former without what the building no longer has.

What changed is told by the test that ``vislam2tag join`` makes (:mod:`vislam2tag.datasets.changes`): readings
of access points that are gone or were moved are left out of what was learned, so that no scan is judged by them. Scans
of places that were walked again stay: without them errors were greater (docs/results/positioning-change.md).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import polars as pl

from vislam2tag.common.errors import DatasetError
from vislam2tag.core.arrays import BoolArray
from vislam2tag.core.status import Status
from vislam2tag.datasets.changes import APPEARED, MOVED, VANISHED, survey_changes
from vislam2tag.datasets.model import Dataset, DatasetInfo
from vislam2tag.datasets.schema import ACCESS_POINTS, FINGERPRINTS, READINGS, in_schema
from vislam2tag.positioning.places import LabelledScans, joined_places
from vislam2tag.positioning.radio_scans import joined_scans


@dataclass(frozen=True)
class ModelUpdate:
    """What an updated model learns from."""

    learned: LabelledScans
    """Old scans first; those that hear nothing any more are left out."""
    added: int
    """Scans of the later survey that the model did not know."""
    gone: tuple[str, ...]
    """Access points whose old readings are left out: they are heard no more where they were loud ..."""
    moved: tuple[str, ...]
    """... or elsewhere."""
    new: tuple[str, ...]
    """Access points that the old scans could not hear."""


def updated(known: LabelledScans, later: LabelledScans, technology: str = "wifi") -> ModelUpdate:
    """Join what a model learned and a later survey, which may be partial, or hold the known scans, too.

    Raises DatasetError where the later survey has nothing that is not known.
    """
    scans, places = joined_scans([known[0], later[0]]), joined_places([known[1], later[1]])
    old = np.arange(len(scans)) < len(known[0])
    kept = old | ~_known_already((scans, places), len(known[0]))
    scans, places, old = scans[kept], places[kept], old[kept]
    if old.all():
        raise DatasetError("the model knows all fingerprints of the later survey already: there is nothing to update")
    before, since = (_as_dataset((scans[rows], places[rows]), technology) for rows in (old, ~old))
    points = survey_changes(before, since, technology).access_points
    change: dict[str, str] = dict(points.select("bssid", "change").iter_rows())
    outdated = np.array([change.get(name) in {VANISHED, MOVED} for name in scans.access_points])
    scans = scans.only(~(outdated[scans.column] & old[scans.row]))
    heard = scans.heard > 0
    gone, moved, new = (
        tuple(sorted(name for name, one in change.items() if one == kind)) for kind in (VANISHED, MOVED, APPEARED)
    )
    return ModelUpdate((scans[heard], places[heard]), int((~old).sum()), gone, moved, new)


def _known_already(labelled: LabelledScans, count: int) -> BoolArray:
    """Which scans (n,) are the same as one of the first ``count``, at the same place."""
    scans, places = labelled
    ends = zip(scans.start[:-1].tolist(), scans.start[1:].tolist(), strict=True)
    heard = [(scans.column[a:b].tobytes(), scans.rssi_dbm[a:b].tobytes()) for a, b in ends]
    keys = list(zip(heard, places.storey.tolist(), map(tuple, places.xy.tolist()), strict=True))
    known = set(keys[:count])
    return np.array([key in known for key in keys])


def _as_dataset(labelled: LabelledScans, technology: str) -> Dataset:
    """Make the tables that two surveys are compared by."""
    scans, places = labelled
    ids = pl.Series([f"{number:09d}" for number in range(len(scans))])
    storeys = [places.storeys[one] for one in places.storey.tolist()]
    fingerprints = pl.DataFrame(
        {
            "scan_id": ids,
            "building": [storey.building for storey in storeys],
            "floor": [storey.floor for storey in storeys],
            "x": places.xy[:, 0],
            "y": places.xy[:, 1],
            "device": scans.device.tolist(),
            "session": scans.session.tolist(),
        }
    ).with_columns(technology=pl.lit(technology), status=pl.lit(Status.OK.label))
    names = pl.Series(scans.access_points, dtype=pl.String)
    readings = pl.DataFrame({"scan_id": ids[scans.row], "bssid": names[scans.column], "rssi_dbm": scans.rssi_dbm})
    points = pl.DataFrame({"bssid": names, "technology": technology, "mobile": False})
    tables = {FINGERPRINTS: fingerprints, READINGS: readings, ACCESS_POINTS: points}
    return Dataset(
        DatasetInfo(name="", floors=()), {name: in_schema(name, table).lazy() for name, table in tables.items()}
    )
