"""Poses of any tracker, as TUM and EuRoC write them or in an MCAP file, with ``poses.toml`` that names their axes."""

from __future__ import annotations

import io
import json
import re
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, Literal

import numpy as np
import polars as pl
from pydantic import ValidationError

from vislam2tag.common.documentation import page_of
from vislam2tag.common.errors import SessionError, import_extra
from vislam2tag.common.files.given_files import toml_values
from vislam2tag.common.findings import Severity
from vislam2tag.common.records import Record
from vislam2tag.intake.columns import shown, time_unit
from vislam2tag.intake.time_units import FRAMES
from vislam2tag.sessions.apps import AppFormat, in_acs, pose_rows, timed
from vislam2tag.sessions.model import FileRecord
from vislam2tag.sessions.pose_axes import WXYZ, XYZW, plausible_axes
from vislam2tag.sessions.registry import register
from vislam2tag.sessions.session_files import SessionFiles
from vislam2tag.sessions.text_tables import FieldTable
from vislam2tag.sessions.tracker_tables import POSE_COLUMNS
from vislam2tag.sessions.walk_columns import candidates

_TUM = ("time", "x", "y", "z", "qx", "qy", "qz", "qw")
_EUROC = ("time", "x", "y", "z", "qw", "qx", "qy", "qz")
_FURTHER = {8: 0, 9: 1, 17: 9}
"""Fields behind a pose by the number of fields: none, the id of RTAB-Map, velocity and biases of EuRoC."""
_NUMBER = re.compile(r"[+-]?(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d+)?|nan|[+-]?inf", re.IGNORECASE)
_MARKS = re.compile(r"[;,\s]+")
_OURS = {
    **dict(zip(("x", "y", "z"), ("tx", "ty", "tz"), strict=True)),
    **{name: name for name in ("qx", "qy", "qz", "qw")},
}


class PoseAxes(Record):
    """What ``poses.toml`` says of the camera's axes and of the frame that poses are in."""

    camera: Literal["y-up", "y-down"]
    frame: Literal["y-up", "z-up"]
    topic: str | None = None
    """Of an MCAP file, whose poses are meant where it has several."""


def _tum_poses(reading: SessionFiles) -> pl.DataFrame:
    """Poses of all frames. Raises SessionError if their columns or axes are unknown."""
    axes = pose_axes(reading) if reading.has("axes") else None
    file, data = reading.load("poses")
    form = _form(data, f"{reading.folder / file}", _TUM if file.endswith(".tum") else _EUROC)
    read = reading.account("poses", data, form.table.read(form.data, file))
    time = next(name for name in ("time_ns", "time_s") if name in read.columns)
    rows = reading.noted(timed(read.select("row", time, *POSE_COLUMNS), FRAMES, file))
    poses = rows.select(list(POSE_COLUMNS)).to_numpy()
    if axes is not None:
        return pose_rows(rows, in_acs(poses, axes.camera, axes.frame))
    orders = (XYZW,) if form.named else (XYZW, WXYZ if file.endswith(".tum") else _XYZW_OF_EUROC)
    found = plausible_axes(rows["time_ns"].to_numpy(), poses, orders)
    if found is None:
        raise SessionError(
            f"{reading.folder}: there is no poses.toml, which defines the axes of the poses, and the path does not "
            f"show them; {_EXPECTED}"
        )
    camera, frame, order = found
    other = "" if order == XYZW else ", and the order of the quaternion is not the usual one of this format"
    message = (
        f'there is no poses.toml; only with camera = "{camera}" and frame = "{frame}" are these poses those of a '
        f"walking person{other}. Write these two lines to poses.toml if that is right, else the right ones"
    )
    reading.note("columns_guessed", file, message, Severity.INFO)
    return pose_rows(rows, in_acs(poses[:, (0, 1, 2, *order)], camera, frame))


_XYZW_OF_EUROC = (6, 3, 4, 5)
"""Places of x, y, z and w in numbers that were read in the order w, x, y, z, but are in the order x, y, z, w."""


@dataclass(frozen=True)
class _Form:
    table: FieldTable
    data: bytes
    """The file with a separator that the table reads."""
    named: bool
    """Whether a header names the columns."""


def _form(data: bytes, path: str, usual: tuple[str, ...]) -> _Form:
    """Find the columns of a table of poses; raises SessionError, with those found and expected, if it has others."""
    if b";" in data[:_LOOKED_AT]:
        data = data.replace(b",", b".").replace(b";", b",")
    lines = [line.strip() for line in data[:_LOOKED_AT].decode(errors="replace").lstrip("\ufeff").split("\n")]
    first = next((i for i, line in enumerate(lines) if line and not line.startswith("#")), None)
    if first is None:
        return _Form(_table(usual, 0, " ", time="time_s", header=False), data, named=False)
    header = not _NUMBER.fullmatch(_MARKS.split(lines[first])[0])
    row = next((line for line in lines[first + header :] if line), "")
    fields = _MARKS.split(row.rstrip(",")) if row else []
    separator = "," if "," in row else " "
    said = lines[first] if header else lines[first - 1].lstrip("# ") if first else ""
    names = [name.strip() for name in (said.split(",") if "," in said else said.split())]
    columns = candidates(names, "poses") if len(names) == len(fields) else {}
    roles = {found[0].name: role for role, found in columns.items() if len(found) == 1}
    named = len(roles) == len(_TUM)
    if not named and len(fields) not in _FURTHER:
        expected = " ".join(usual)
        raise SessionError(
            f"{path}: found {len(fields)} columns ({shown(names or fields)}); expected {expected} (8 columns), an id "
            "behind them (9, RTAB-Map), velocity and biases (17, EuRoC), or a header that names these columns"
        )
    order = tuple(roles.get(name, f"_{i}") for i, name in enumerate(names)) if named else usual
    further = 0 if named else _FURTHER[len(fields)]
    place = order.index("time") if named else 0
    whole = fields[place].isdigit() and (usual is _EUROC or time_unit(names[place] if named else "") == "ns")
    return _Form(_table(order, further, separator, time="time_ns" if whole else "time_s", header=header), data, named)


_LOOKED_AT = 4000


def _table(order: tuple[str, ...], further: int, separator: str, *, time: str, header: bool) -> FieldTable:
    columns: dict[str, Any] = {}
    for role in (*order, *(f"_{i}" for i in range(100, 100 + further))):
        kind = pl.Int64 if role == "time" and time == "time_ns" else pl.Float64
        columns[time if role == "time" else _OURS.get(role, role)] = kind
    return FieldTable(columns, separator, header)


_EXPECTED = f'write camera = "y-up" or "y-down" and frame = "y-up" or "z-up" into it ({page_of("reference/formats")})'


def pose_axes(reading: SessionFiles) -> PoseAxes:
    """Read ``poses.toml``; raises SessionError where it is not there or says something else."""
    if not reading.has("axes"):
        raise SessionError(
            f"{reading.folder}: there is no poses.toml, which defines the axes of the poses; {_EXPECTED}"
        )
    file, data = reading.load("axes")
    try:
        return PoseAxes.model_validate(toml_values(data))
    except (ValueError, ValidationError) as error:
        raise SessionError(f"{reading.folder / file}: not understood; {_EXPECTED}") from error


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
