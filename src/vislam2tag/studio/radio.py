"""Radio maps for the page: of each access point, of all together, and changes between the labels and other outputs.

A data set is built from the labels in a temporary folder, and maps from it, both as by the command line
(``vislam2tag dataset``, ``vislam2tag radio-maps``, ``vislam2tag join``).
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Literal

import numpy as np

from vislam2tag.common.files.folder import scratch_folder
from vislam2tag.common.records import FiniteRecord
from vislam2tag.datasets.changes import ChangedPoint, SurveyChanges, survey_changes, survey_record
from vislam2tag.datasets.model import Dataset
from vislam2tag.datasets.privacy import Privacy
from vislam2tag.datasets.radio_maps import FloorMaps, MapLayer, radio_maps
from vislam2tag.pipeline.datasets.build import BuildOptions, build_dataset
from vislam2tag.settings import Settings
from vislam2tag.studio.messages import Box, Point, seen_as
from vislam2tag.studio.outputs import BEFORE, LABELS
from vislam2tag.studio.workspace import Workspace


class RadioPoint(FiniteRecord):
    """An access point with a map."""

    bssid: str
    ssid: str | None
    readings: int
    loudest_dbm: float | None
    rms_db: float | None
    """Errors of readings that were predicted without their own walk."""
    place_m: Point | None
    """Estimated position: the maximum of its map, BCS."""


class RadioFloor(FiniteRecord):
    """The maps of a floor and technology, those with most readings first; all with the same cells."""

    floor: int
    technology: str
    extent_m: Box
    rows: int
    columns: int
    access_points: list[RadioPoint]


class RadioChanges(FiniteRecord):
    """Changes between the labels and another output."""

    output: str
    technology: str
    counts: dict[str, int]
    changed: list[ChangedPoint]


class RadioView(FiniteRecord):
    """All radio maps; ``stale``: labels have changed since."""

    state: Literal["none", "stale", "ready"]
    floors: list[RadioFloor]
    changes: list[RadioChanges]


STRONGEST, NUMBER = "strongest", "number"
"""Layers of all access points together; the others are those of :class:`FloorMaps`."""


@dataclass(frozen=True)
class RadioJob:
    """Input of radio maps: a survey, the folder of its labels, and folders for comparison by name."""

    root: Path
    labels: Path
    compared: Mapping[str, Path]
    settings: Settings
    privacy: Privacy | None = None
    """Data to remove or hide; None: nothing."""
    follow_links: bool = True
    """Whether to include sessions that links lead to outside the survey."""


@dataclass(frozen=True)
class Radio:
    """The maps of each floor and technology, and the changes between the labels and each further output."""

    floors: tuple[FloorMaps, ...]
    changes: Mapping[str, SurveyChanges]

    def layer(self, floor: int, technology: str, layer: str, bssid: str) -> tuple[FloorMaps, MapLayer]:
        """A layer (rows, columns) of a floor and its maps; raises KeyError if there is none."""
        places = ((one.place.floor, one.place.technology) for one in self.floors)
        maps = dict(zip(places, self.floors, strict=True)).get((floor, technology))
        if maps is None:
            raise KeyError(f"radio map of floor {floor}")
        if layer == STRONGEST:
            return maps, np.fmax.reduce(maps.mean_dbm, axis=0)
        if layer == NUMBER:
            known = np.isfinite(maps.heard).any(axis=0)
            return maps, np.where(known, np.nansum(maps.heard, axis=0), np.nan).astype(np.float32)
        number = next((i for i, one in enumerate(maps.maps) if one.bssid == bssid), None)
        if number is None:
            raise KeyError(f"radio map of {bssid}")
        found: MapLayer = getattr(maps, layer)[number]
        return maps, found

    def view(self, *, stale: bool) -> RadioView:
        """The available maps."""
        return RadioView(
            state="stale" if stale else "ready",
            floors=[_floor(maps) for maps in self.floors],
            changes=[
                RadioChanges(
                    output=name, technology=one.technology, counts=one.access_points, changed=list(one.changed)
                )
                for name, changes in self.changes.items()
                for one in changes.technologies
            ],
        )


def radio_job(workspace: Workspace, privacy: Privacy | None = None, *, follow_links: bool = True) -> RadioJob:
    """The job for the current labels."""
    compared = {name: output.root for name, output in workspace.outputs.items() if name not in (LABELS, BEFORE)}
    return RadioJob(workspace.root, workspace.out, compared, workspace.settings, privacy, follow_links)


def made_radio(job: RadioJob) -> Radio:
    """Make the maps; runs in a worker. Raises DatasetError if nothing is labelled or received often enough."""
    with scratch_folder() as scratch:
        own = _dataset(job, job.labels, scratch / LABELS, (job.root,))
        technologies = own.fingerprints.select("technology").unique().collect()["technology"].sort().to_list()
        changes = {}
        for name, folder in job.compared.items():
            other = _dataset(job, folder, scratch / name, ())
            found = [survey_changes(own, other, technology) for technology in technologies]
            changes[name] = survey_record(own.info.name, other.info.name, found)
        return Radio(tuple(radio_maps(own, job.settings.radio_maps)), changes)


def _dataset(job: RadioJob, labels: Path, out: Path, surveys: tuple[Path, ...]) -> Dataset:
    options = BuildOptions(
        surveys=surveys, privacy=job.privacy, walked=(), follow_links=job.follow_links
    )  # the page of this data set is never shown
    return build_dataset(labels, out, job.settings.dataset, options)


def _floor(maps: FloorMaps) -> RadioFloor:
    return RadioFloor(
        floor=maps.place.floor,
        technology=maps.place.technology,
        extent_m=maps.grid.extent_m,
        rows=maps.grid.rows,
        columns=maps.grid.columns,
        access_points=[_point(maps, number) for number in range(len(maps.maps))],
    )


def _point(maps: FloorMaps, number: int) -> RadioPoint:
    """An access point; its position is estimated as the maximum of its smoothed map."""
    one, mean = maps.maps[number], maps.mean_dbm[number]
    place = None
    if np.isfinite(mean).any():
        cell = np.array(np.unravel_index(int(np.nanargmax(mean)), mean.shape))
        x, y = maps.grid.centres_m(cell[None])[0].tolist()
        place = (round(x, 2), round(y, 2))
    return seen_as(RadioPoint, one, rms_db=one.errors.rms_db, place_m=place)
