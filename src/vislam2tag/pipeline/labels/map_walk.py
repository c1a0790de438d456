"""One walk from tables in memory to positions: what ``process`` does with a session, without a folder."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np

from vislam2tag.labeling.mapped_walk import MappedWalk
from vislam2tag.labeling.settings import ProcessSettings
from vislam2tag.labeling.tables import LabelledWalk
from vislam2tag.pipeline.labels.findings import walk_findings
from vislam2tag.sessions.in_memory import Table, landmarks_in_memory, session_in_memory
from vislam2tag.sessions.prepared import SessionTask, prepared_from
from vislam2tag.site.corrections.file import Corrections
from vislam2tag.site.model import ControlPoints, Floor, SessionKey, SessionRef, Site


def map_walk(
    poses: Table,
    sightings: Table,
    landmarks: Table,
    *,
    sensors: Table | None = None,
    floor: int | None = None,
    settings: ProcessSettings | None = None,
) -> MappedWalk:
    """Map one walk, from tables in memory (Polars, pandas, Arrow), as ``process`` maps a session.

        result = vislam2tag.map_walk(poses, sightings, landmarks)
        result.frames, result.findings, result.label(wifi), result.plot()

    Columns; others are ignored, and rows count from 1:

    * ``poses``: ``time_ns`` (integers, ns), ``tx, ty, tz`` (metres) and the unit quaternion ``qx, qy, qz, qw``, from
      the camera to the tracker's frame, whose y is up. The camera looks along its own -z;
    * ``sightings``: ``time_ns`` (that of a pose), ``id`` (text or whole numbers), ``tx`` .. ``qw`` of the landmark in
      the tracker's frame;
    * ``landmarks``: ``id``, ``x``, ``y`` (metres on the plan); optionally ``z``, ``sigma_m`` (per axis; 0.02 if
      missing), ``heading_rad`` (of the sheet's X axis, from x), ``heading_sigma_rad`` and ``floor`` (whole number);
    * ``sensors``: ``time_ns``, ``sensor``, ``v1`` .. ``v6``, as in ``sensors.csv`` (docs/reference/session-files.md):
      air pressure for floors, inertial readings for tracking losses. ``process`` uses them if they are there.

    ``floor`` is the number of the floor on which the walk starts; it is needed if ``landmarks`` has several. A walk
    that cannot be mapped has frames without positions, and ``findings`` say why. Raises UsageError, naming table,
    column and row, for tables that cannot be used, SessionError for poses that cannot be a walk's.
    """
    settings = settings or ProcessSettings()
    surveyed, own, site_findings = landmarks_in_memory(landmarks, floor, settings.survey.landmark_sigma_m)
    key = SessionKey(own, "in memory", "walk")
    session = session_in_memory(key, poses, sightings, sensors, settings.findings)
    site = Site(tuple(map(_floor, sorted({own, *surveyed.floor.tolist()}))), surveyed)
    ref = SessionRef(key, Path(), "memory", "walk")
    task = SessionTask(ref, site, Corrections(), settings.survey.landmark_sigma_m, settings.findings)
    prepared = prepared_from(task, session)
    prepared.refuse_unfit(inertial=settings.inertial)
    prepared = replace(prepared, session=replace(prepared.session, tables={}))  # sensors were used, and need no labels
    walk = LabelledWalk.of(prepared, settings)
    findings = (*site_findings, *walk_findings(prepared, walk, settings))
    return MappedWalk(walk, prepared.landmarks, findings)


def _floor(number: int) -> Floor:
    """A floor of which no more than the number is known."""
    return Floor(number, f"floor {number}", None, None, None, None, ControlPoints((), np.empty((0, 2))))
