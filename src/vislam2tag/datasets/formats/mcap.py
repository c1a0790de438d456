"""Trajectories and labelled radio readings as MCAP, one file for each session, with Foxglove's schemas in JSON.

``foxglove_schemas.json`` contains the schemas as published by Foxglove (MIT licence).
"""

from __future__ import annotations

import base64
import json
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

import numpy as np
import polars as pl

from vislam2tag import __version__
from vislam2tag.common.errors import DatasetError, import_extra
from vislam2tag.common.files.folder import Folder
from vislam2tag.common.files.given_files import read_bytes, read_json
from vislam2tag.common.findings import Finding, finding_if
from vislam2tag.core.arrays import FloatArray
from vislam2tag.core.status import has_position
from vislam2tag.core.tracks import Trajectory
from vislam2tag.datasets.annotated_tables import PrivateLabels
from vislam2tag.datasets.format_registry import ExportContext, ExportFormat, register
from vislam2tag.datasets.labelled import LabelledSession
from vislam2tag.datasets.writing import UNMAPPED, shared_labels
from vislam2tag.labeling.results import FloorRecord
from vislam2tag.labeling.tables import SCHEMAS, TRAJECTORY, trajectory_of
from vislam2tag.site.discover import read_site
from vislam2tag.site.georeference import Georeference, to_wgs84
from vislam2tag.site.links import left_out_of

READINGS = {"wifi": tuple(SCHEMAS["wifi"]), "ble": tuple(SCHEMAS["ble"])}
HOLDS = {
    TRAJECTORY: ("floor", "time_ns", "x", "y", "z", "qx", "qy", "qz", "qw", "cov_xx", "cov_xy", "cov_yy"),
    **READINGS,
}
_READING = "vislam2tag.LabelledReading"
_OUTLINE_M = 0.1
_IMAGES = {".png": "png", ".jpg": "jpeg", ".jpeg": "jpeg"}
_NO_TURN = {"x": 0.0, "y": 0.0, "z": 0.0, "w": 1.0}
_KNOWN = 3
"""Foxglove's code for a known covariance."""
_HEIGHT_M2 = 1.0
"""Variance of heights in fixes, because labels have none."""
Message = tuple[str, str, int, bytes]
"""Topic, schema, time in ns, JSON."""


def foxglove_schemas() -> dict[str, Any]:
    """The JSON schemas of the written Foxglove messages, by name."""
    schemas: dict[str, Any] = read_json(Path(__file__).with_name("foxglove_schemas.json"))["schemas"]
    return schemas


def write(labels: Path, folder: Folder, context: ExportContext) -> tuple[Finding, ...]:
    """Write a file for each session that has a position; the others are counted.

    Raises DatasetError if ``labels`` is not a finished output of ``process`` or no session has a position, and
    SurveyError if the survey is invalid.
    """
    opened, outside = shared_labels(labels, context)
    plans, plans_left_out = _plans(context, opened.floors)
    private = PrivateLabels.of(opened.sessions, context.privacy)
    unmapped = 0
    for session in opened.sessions:
        trajectory = trajectory_of(session.table(TRAJECTORY, SCHEMAS[TRAJECTORY]))
        labelled = has_position(trajectory.status)
        if labelled.any():
            messages = [*_of_trajectory(trajectory, opened.floors), *_of_readings(session, private)]
            start_ns = int(trajectory.time_ns[labelled].min())
            _write(folder, f"{session.slug}.mcap", [*_of_plans(plans, start_ns), *messages])
        unmapped += not labelled.any()
        context.progress(session.slug, len(opened.sessions))
    if unmapped == len(opened.sessions):
        raise DatasetError(f"{labels}: none of its sessions has a position; report.html gives the reason")
    left_out = finding_if(unmapped, "unmapped_sessions", UNMAPPED)
    return (*outside, *plans_left_out, *private.findings, *left_out)


def _write(folder: Folder, name: str, messages: list[Message]) -> None:
    writer_module = import_extra("mcap.writer")
    schemas: Mapping[str, Any] = {**foxglove_schemas(), _READING: {"title": _READING, "type": "object"}}
    with folder.writing(name) as file:
        writer = writer_module.Writer(file)
        writer.start(library=f"vislam2tag {__version__}")
        ids: dict[str, int] = {}
        channels: dict[str, int] = {}
        for topic, schema, time_ns, data in sorted(messages, key=lambda message: message[2]):
            if schema not in ids:
                ids[schema] = writer.register_schema(schema, "jsonschema", json.dumps(schemas[schema]).encode())
            if topic not in channels:
                channels[topic] = writer.register_channel(topic, "json", ids[schema])
            writer.add_message(channels[topic], time_ns, data, time_ns)
        writer.finish()


def _of_trajectory(trajectory: Trajectory, floors: tuple[FloorRecord, ...]) -> Iterator[Message]:
    """Pose and transform of each frame with a position, and its fix if its floor has a georeference."""
    known = {floor.number: floor for floor in floors}
    for i in np.flatnonzero(has_position(trajectory.status)).tolist():
        time_ns, floor = int(trajectory.time_ns[i]), int(trajectory.floor[i])
        stamp, frame = _stamp(time_ns), _frame(floor)
        position = dict(zip("xyz", np.nan_to_num(trajectory.position_bcs[i]).tolist(), strict=True))
        turn = trajectory.orientation_bcs[i]
        rotation = dict(zip("xyzw", turn.tolist(), strict=True)) if np.isfinite(turn).all() else _NO_TURN
        pose = {"timestamp": stamp, "frame_id": frame, "pose": {"position": position, "orientation": rotation}}
        yield _message("/pose", "foxglove.PoseInFrame", time_ns, pose)
        transform = {"timestamp": stamp, "parent_frame_id": frame, "child_frame_id": "camera"}
        moved = {**transform, "translation": position, "rotation": rotation}
        yield _message("/tf", "foxglove.FrameTransform", time_ns, moved)
        georeference = known[floor].georeference if floor in known else None
        if georeference is not None:
            height = (known[floor].elevation_m or 0.0) + position["z"]
            fix = _fix(trajectory.position_bcs[i, :2], trajectory.covariance_bcs[i], georeference)
            yield _message(
                "/fix",
                "foxglove.LocationFix",
                time_ns,
                {"timestamp": stamp, "frame_id": "camera", "altitude": height, **fix},
            )


def _fix(position_bcs: FloatArray, covariance_bcs: FloatArray, georeference: Georeference) -> dict[str, object]:
    """Latitude, longitude and covariance (east, north, up) of a position (2,) with its covariance (2, 2)."""
    longitude, latitude = to_wgs84(position_bcs[None], georeference)[0].tolist()
    bearing = np.radians(georeference.bearing_deg)
    enu_R_bcs = np.array(((np.cos(bearing), np.sin(bearing)), (-np.sin(bearing), np.cos(bearing))))
    covariance = np.zeros((3, 3))
    covariance[:2, :2] = enu_R_bcs @ np.nan_to_num(covariance_bcs) @ enu_R_bcs.T
    covariance[2, 2] = _HEIGHT_M2
    known = bool(np.isfinite(covariance_bcs).all())
    return {
        "latitude": latitude,
        "longitude": longitude,
        "position_covariance": covariance.ravel().tolist(),
        "position_covariance_type": _KNOWN if known else 0,
    }


def _of_readings(session: LabelledSession, private: PrivateLabels) -> Iterator[Message]:
    """Each labelled reading of the radio tables, with all its columns."""
    for name, columns in READINGS.items():
        if not session.has(name):
            continue
        table = private.hidden(session.table(name, columns)) if name == "wifi" else session.table(name, columns)
        texts = table.select(pl.struct(pl.all()).struct.json_encode()).to_series().to_list()
        for time_ns, text in zip(table["time_ns"].to_list(), texts, strict=True):
            yield f"/labels/{name}", _READING, time_ns, text.encode()


_Plan = tuple[FloorRecord, tuple[str, bytes] | None]
"""A floor and the image of its plan: Foxglove's name of its format, and its file."""


def _plans(context: ExportContext, floors: tuple[FloorRecord, ...]) -> tuple[list[_Plan], list[Finding]]:
    """The floors, with the images of their plans if the survey is available, and findings about skipped ones."""
    files, left_out = {}, []
    if context.survey is not None:
        site, findings = read_site(context.survey, follow_links=context.follow_links)
        files = {floor.number: floor.plan for floor in site.floors}
        left_out = left_out_of(findings)
        context.tell(left_out)
    plans = []
    for floor in floors:
        file = files.get(floor.number)
        kind = None if file is None else _IMAGES.get(file.suffix.lower())
        plans.append((floor, (kind, read_bytes(file)) if file is not None and kind is not None else None))
    return plans, left_out


def _of_plans(plans: list[_Plan], time_ns: int) -> Iterator[Message]:
    """Outline of each floor with a known extent, as a scene, and the image of its plan."""
    stamp = _stamp(time_ns)
    for floor, image in plans:
        frame = _frame(floor.number)
        if floor.width_m is not None and floor.height_m is not None:
            scene = {"deletions": [], "entities": [_outline(floor, stamp, frame)]}
            yield _message(f"/plan/{frame}", "foxglove.SceneUpdate", time_ns, scene)
        if image is not None:
            kind, content = image
            data = base64.b64encode(content).decode()
            picture = {"timestamp": stamp, "frame_id": frame, "format": kind, "data": data}
            yield _message(f"/plan_image/{frame}", "foxglove.CompressedImage", time_ns, picture)


def _outline(floor: FloorRecord, stamp: dict[str, int], frame: str) -> dict[str, object]:
    left, low = floor.lower_left_m
    right, high = left + (floor.width_m or 0.0), low + (floor.height_m or 0.0)
    line = {
        "type": 1,
        "pose": {"position": {"x": 0.0, "y": 0.0, "z": 0.0}, "orientation": _NO_TURN},
        "thickness": _OUTLINE_M,
        "scale_invariant": False,
        "points": [{"x": x, "y": y, "z": 0.0} for x, y in ((left, low), (right, low), (right, high), (left, high))],
        "color": {"r": 0.3, "g": 0.3, "b": 0.3, "a": 1.0},
        "colors": [],
        "indices": [],
    }
    others = dict.fromkeys(("arrows", "cubes", "spheres", "cylinders", "triangles", "texts", "models"), ())
    return {
        "timestamp": stamp,
        "frame_id": frame,
        "id": floor.name,
        "lifetime": {"sec": 0, "nsec": 0},
        "frame_locked": False,
        "metadata": [],
        "lines": [line],
        **others,
    }


def _frame(floor: int) -> str:
    """Name of a floor's frame, its BCS."""
    return f"floor_{floor}"


def _stamp(time_ns: int) -> dict[str, int]:
    return {"sec": time_ns // 1_000_000_000, "nsec": time_ns % 1_000_000_000}


def _message(topic: str, schema: str, time_ns: int, content: Mapping[str, object]) -> Message:
    return topic, schema, time_ns, json.dumps(content).encode()


register(writes=ExportFormat("mcap", HOLDS, takes=("survey",), write_labels=write))
