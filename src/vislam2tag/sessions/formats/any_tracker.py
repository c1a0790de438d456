"""Poses of any tracker, as TUM and EuRoC write them or in an MCAP file, with ``poses.toml`` that names their axes."""

from __future__ import annotations

import io
import json
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any, Literal

import numpy as np
import polars as pl
from pydantic import ValidationError

from vislam2tag.common.errors import SessionError
from vislam2tag.common.extras import import_extra
from vislam2tag.common.files.plain_files import toml_values
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
    expected = 'write camera = "y-up" or "y-down" and frame = "y-up" or "z-up" into it (docs/reference/formats.md)'
    if not reading.has("axes"):
        raise SessionError(
            f"{reading.folder}: no poses.toml, without which the axes of poses are not known; {expected}"
        )
    file, data = reading.load("axes")
    try:
        return PoseAxes.model_validate(toml_values(data))
    except (ValueError, ValidationError) as error:
        raise SessionError(f"{reading.folder / file}: not understood; {expected}") from error


_SCHEMA = "foxglove.PoseInFrame"
_POSITION, _TURN = ("x", "y", "z"), ("x", "y", "z", "w")


_Decoder = Callable[[bytes], tuple[int, list[float]]]
"""From a message to its time, ns, and its pose."""


@dataclass
class _Topics:
    """Times, ns, and poses (position, then quaternion) of each topic that has some."""

    time_ns: dict[str, list[int]] = field(default_factory=dict)
    poses: dict[str, list[list[float]]] = field(default_factory=dict)
    others: set[str] = field(default_factory=set)
    """Schemas of what else there is."""
    end: str = ""
    """What ended the file early; empty where it is whole."""


def _mcap_poses(reading: SessionFiles) -> pl.DataFrame:
    """Poses of all messages. Raises SessionError if the file has none, or ``poses.toml`` does not say whose."""
    axes = pose_axes(reading)
    file, data = reading.load("poses")
    topics = _topics(data)
    name = _chosen(topics, axes, f"{reading.folder / file}")
    time_ns, values = topics.time_ns[name], np.array(topics.poses[name]).reshape(-1, 7)
    count = len(time_ns)
    reading.files.append(FileRecord.of(file, "poses", data, count, count))
    if topics.end:
        message = f"the file ends early ({topics.end}), as when the recorder is killed; what came before counts"
        reading.note("partial_last_line", file, message)
    rows = pl.DataFrame({"row": np.arange(1, count + 1), "time_ns": np.array(time_ns, dtype=np.int64)})
    return pose_rows(rows, in_acs(values, axes.camera, axes.frame))


def _chosen(topics: _Topics, axes: PoseAxes, path: str) -> str:
    names = sorted(topics.poses)
    if not names:
        found = f"; it holds {', '.join(sorted(topics.others))}" if topics.others else ""
        why = f" ({topics.end})" if topics.end else ""
        raise SessionError(f"{path}: holds no message of {_SCHEMA}{why}{found}: record poses by this schema")
    if axes.topic is None and len(names) == 1:
        return names[0]
    if axes.topic not in names:
        raise SessionError(f'{path}: has poses of {", ".join(names)}: say in poses.toml which, topic = "{names[0]}"')
    return axes.topic


def _topics(data: bytes) -> _Topics:
    """Read the poses of all topics, up to where the file is damaged."""
    reader, records = import_extra("mcap.stream_reader"), import_extra("mcap.records")
    decoders = import_extra("mcap_protobuf.decoder").DecoderFactory()
    found, schemas, channels = _Topics(), dict[int, Any](), dict[int, Any]()
    known: dict[int, _Decoder] = {}
    try:
        for record in reader.StreamReader(io.BytesIO(data), record_size_limit=len(data) + 1).records:
            if isinstance(record, records.Schema):
                schemas[record.id] = record
            elif isinstance(record, records.Channel):
                channels[record.id] = record
                schema = schemas.get(record.schema_id)
                if schema is not None and schema.name == _SCHEMA:
                    known[record.id] = _decoder(decoders.decoder_for(record.message_encoding, schema))
                elif schema is not None:
                    found.others.add(schema.name)
            elif isinstance(record, records.Message) and record.channel_id in known:
                time_ns, pose = known[record.channel_id](record.data)
                topic = channels[record.channel_id].topic
                found.time_ns.setdefault(topic, []).append(time_ns)
                found.poses.setdefault(topic, []).append(pose)
    except Exception as error:  # the library raises what its decompressors and struct do; all mean a damaged file
        found.end = f"{type(error).__name__}: {error}".strip(" :")[:80]
    return found


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
