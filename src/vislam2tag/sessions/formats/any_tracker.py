"""Poses of any tracker, as TUM and EuRoC write them or in an MCAP file, with ``poses.toml`` that names their axes."""

from __future__ import annotations

import io
import json
from collections.abc import Callable
from typing import Any, Literal

import numpy as np
import polars as pl
from pydantic import ValidationError

from vislam2tag.common.documentation import page_of
from vislam2tag.common.errors import SessionError, import_extra
from vislam2tag.common.files.given_files import toml_values
from vislam2tag.common.records import Record
from vislam2tag.sessions.apps import AppFormat, in_acs, pose_rows, pose_table
from vislam2tag.sessions.model import FileRecord
from vislam2tag.sessions.registry import register
from vislam2tag.sessions.session_files import SessionFiles
from vislam2tag.sessions.text_tables import FieldTable
from vislam2tag.sessions.tracker_tables import POSE_COLUMNS

_TUM = FieldTable({"time_s": pl.Float64, **POSE_COLUMNS}, " ")
_EUROC = FieldTable({"time_ns": pl.Int64, **dict.fromkeys(("tx", "ty", "tz", "qw", "qx", "qy", "qz"), pl.Float64)}, ",")


class PoseAxes(Record):
    """What ``poses.toml`` says of the camera's axes and of the frame that poses are in."""

    camera: Literal["y-up", "y-down"]
    frame: Literal["y-up", "z-up"]
    topic: str | None = None
    """Of an MCAP file, whose poses are meant where it has several."""


def _tum_poses(reading: SessionFiles) -> pl.DataFrame:
    """Poses of all frames. Raises SessionError if ``poses.toml`` does not say in which axes they are."""
    axes = pose_axes(reading)
    table = _TUM if reading.name_of("poses").endswith(".tum") else _EUROC
    return pose_table(table.read, axes.camera, axes.frame)(reading)


def pose_axes(reading: SessionFiles) -> PoseAxes:
    """Read ``poses.toml``; raises SessionError where it is not there or says something else."""
    expected = (
        f'write camera = "y-up" or "y-down" and frame = "y-up" or "z-up" into it ({page_of("reference/formats")})'
    )
    if not reading.has("axes"):
        raise SessionError(f"{reading.folder}: there is no poses.toml, which defines the axes of the poses; {expected}")
    file, data = reading.load("axes")
    try:
        return PoseAxes.model_validate(toml_values(data))
    except (ValueError, ValidationError) as error:
        raise SessionError(f"{reading.folder / file}: not understood; {expected}") from error


_SCHEMA = "foxglove.PoseInFrame"
_POSITION, _TURN = ("x", "y", "z"), ("x", "y", "z", "w")


_Decoder = Callable[[bytes], tuple[int, list[float]]]
"""From a message to its time, ns, and its pose."""


_Topics = dict[str, list[tuple[int, list[float]]]]
"""Times, ns, and poses (position, then quaternion) of each topic that has some."""


def _mcap_poses(reading: SessionFiles) -> pl.DataFrame:
    """Poses of all messages. Raises SessionError if the file has none, or ``poses.toml`` does not say whose."""
    axes = pose_axes(reading)
    file, data = reading.load("poses")
    topics, others, end = _topics(data)
    if not topics:
        found = f"; it contains {', '.join(sorted(others))}" if others else ""
        why = f" ({end})" if end else ""
        path = reading.folder / file
        raise SessionError(f"{path}: contains no message of {_SCHEMA}{why}{found}: record poses with this schema")
    stamped = topics[_chosen(sorted(topics), axes, f"{reading.folder / file}")]
    count = len(stamped)
    reading.files.append(FileRecord.of(file, "poses", data, count, count))
    if end:
        message = f"the file ends early ({end}), as if the recording app was killed; the data before that is used"
        reading.note("partial_last_line", file, message)
    time_ns = np.array([time_ns for time_ns, _ in stamped], dtype=np.int64)
    rows = pl.DataFrame({"row": np.arange(1, count + 1), "time_ns": time_ns})
    return pose_rows(rows, in_acs(np.array([pose for _, pose in stamped]), axes.camera, axes.frame))


def _chosen(names: list[str], axes: PoseAxes, path: str) -> str:
    if axes.topic is None and len(names) == 1:
        return names[0]
    if axes.topic not in names:
        raise SessionError(f'{path}: has poses of {", ".join(names)}: choose one in poses.toml, topic = "{names[0]}"')
    return axes.topic


def _topics(data: bytes) -> tuple[_Topics, set[str], str]:
    """Poses of all topics, up to where the file is damaged; schemas of what else there is; what ended the file early.

    The last is empty where the file is whole.
    """
    reader, records = import_extra("mcap.stream_reader"), import_extra("mcap.records")
    decoders = import_extra("mcap_protobuf.decoder").DecoderFactory()
    found, others, schemas, topics = _Topics(), set[str](), dict[int, Any](), dict[int, tuple[str, _Decoder]]()
    try:
        for record in reader.StreamReader(io.BytesIO(data), record_size_limit=len(data) + 1).records:
            if isinstance(record, records.Schema):
                schemas[record.id] = record
            elif isinstance(record, records.Channel):
                schema = schemas.get(record.schema_id)
                if schema is not None and schema.name == _SCHEMA:
                    decoder = _decoder(decoders.decoder_for(record.message_encoding, schema))
                    topics[record.id] = record.topic, decoder
                elif schema is not None:
                    others.add(schema.name)
            elif isinstance(record, records.Message) and record.channel_id in topics:
                topic, decoder = topics[record.channel_id]
                stamped = decoder(record.data)
                found.setdefault(topic, []).append(stamped)
    except Exception as error:  # the library raises what its decompressors and struct do; all mean a damaged file
        return found, others, f"{type(error).__name__}: {error}".strip(" :")[:80]
    return found, others, ""


def _decoder(of_protobuf: Callable[[bytes], Any] | None) -> _Decoder:
    """Of JSON where the message's schema is none of Protobuf."""
    return _of_json if of_protobuf is None else lambda content: _of_protobuf(of_protobuf(content))


def _of_json(content: bytes) -> tuple[int, list[float]]:
    message = json.loads(content)
    stamp, pose = message["timestamp"], message["pose"]
    numbers = [*(pose["position"][axis] for axis in _POSITION), *(pose["orientation"][axis] for axis in _TURN)]
    return int(stamp["sec"]) * 1_000_000_000 + int(stamp["nsec"]), [float(number) for number in numbers]


def _of_protobuf(message: Any) -> tuple[int, list[float]]:
    stamp, position, turn = message.timestamp, message.pose.position, message.pose.orientation
    numbers = [*(getattr(position, axis) for axis in _POSITION), *(getattr(turn, axis) for axis in _TURN)]
    return int(stamp.seconds) * 1_000_000_000 + int(stamp.nanos), numbers


_AXES_FILE = {"axes": ("poses.toml",)}
register(AppFormat("tum", {"poses": ("poses.tum", "poses_euroc.csv"), **_AXES_FILE}, _tum_poses))
register(AppFormat("mcap", {"poses": ("poses.mcap",), **_AXES_FILE}, _mcap_poses))
