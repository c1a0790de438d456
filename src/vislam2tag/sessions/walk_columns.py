"""Recognise the tables of a walk and their columns by name, or as ``columns.toml`` names them.

A table has a kind (poses, sightings, wifi, ble, sensors, or one sensor), its columns have roles. No file is read here.
"""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from typing import Literal

import polars as pl

from vislam2tag.common.errors import UsageError
from vislam2tag.common.files.toml_file import toml_value
from vislam2tag.common.records import Record
from vislam2tag.intake.columns import (
    COLUMNS_FILE,
    Column,
    address_column,
    columns_toml,
    given_column,
    matching_columns,
    missing_column,
    plain_name,
    shown,
)

SENSORS: Mapping[str, str] = {"acc": "ACC", "gyro": "GYRO", "mag": "MAG", "pressure": "PRESSURE"}
"""Kinds of tables that are of one sensor: its type in the table ``sensors``."""
_SENSOR_NAMES = {
    "acc": "acc acce accel acceleration accelerometer totalacceleration",
    "gyro": "gyr gyro gyroscope rotationrate angularvelocity",
    "mag": "mag magn magnetic magnetometer magneticfield",
    "pressure": "pressure pres baro barometer airpressure",
}
SENSOR_TYPES = {name: SENSORS[kind] for kind, names in _SENSOR_NAMES.items() for name in names.split()}
"""Types in the table ``sensors`` by the names that loggers give sensors, in normal form."""
_TIME = {"time": ("time",)}
_TURN = {role: (role,) for role in ("qx", "qy", "qz", "qw")}
_VALUES = {f"v{i}": (f"value_{i}",) for i in range(1, 7)}
_ROLES: Mapping[str, Mapping[str, tuple[str, ...]]] = {
    "poses": {**_TIME, **{axis: (f"pose_{axis}",) for axis in "xyz"}, **_TURN},
    "sightings": {
        **_TIME,
        "id": ("landmark", "landmark_id"),
        **{f"d{axis}": (f"offset_{axis}",) for axis in "xyz"},
        **{axis: (f"landmark_{axis}", f"pose_{axis}") for axis in "xyz"},
        **_TURN,
    },
    "wifi": {role: (role,) for role in ("time", "address", "level", "ssid", "scan", "frequency", "technology")},
    "ble": {
        **_TIME,
        "address": ("beacon_address",),
        "level": ("level",),
        "name": ("beacon_name",),
        **{role: (role,) for role in ("uuid", "major", "minor", "technology")},
    },
    "sensors": {**_TIME, "type": ("sensor_type",), **_VALUES},
    **{kind: {**_TIME, **_VALUES} for kind in SENSORS},
}
"""For each kind of table and role the roles of intake.columns whose names count: the first that has a column."""
_REQUIRED: Mapping[str, tuple[str, ...]] = {
    "poses": ("qw", "qx", "qy", "qz", "time", "x", "y", "z"),
    "sightings": ("time", "id"),
    "wifi": ("time", "address", "level"),
    "ble": ("time", "address", "level"),
    "sensors": ("time", "type", "v1"),
    **{kind: ("time", "v1", "v2", "v3") for kind in SENSORS if kind != "pressure"},
    "pressure": ("time", "v1"),
}
_POSITIONS = ("x", "y", "z"), ("dx", "dy", "dz")
"""Sightings have one of these."""


class TableColumns(Record):
    """A section of ``columns.toml``: the file of a table and the names of its columns by role.

    An empty name states that the table has no such column.
    """

    file: str | None = None
    time: str | None = None
    time_unit: Literal["s", "ms", "us", "ns"] | None = None
    zone: str | None = None
    """Time zone of dates without one, such as ``Europe/Berlin``."""
    x: str | None = None
    y: str | None = None
    z: str | None = None
    qx: str | None = None
    qy: str | None = None
    qz: str | None = None
    qw: str | None = None
    dx: str | None = None
    dy: str | None = None
    dz: str | None = None
    """Offset of a landmark in the axes of the camera."""
    length_unit: str | None = None
    camera: Literal["y-up", "y-down"] | None = None
    frame: Literal["y-up", "z-up"] | None = None
    id: str | None = None
    address: str | None = None
    level: str | None = None
    ssid: str | None = None
    scan: str | None = None
    frequency: str | None = None
    technology: str | None = None
    name: str | None = None
    uuid: str | None = None
    major: str | None = None
    minor: str | None = None
    type: str | None = None
    v1: str | None = None
    v2: str | None = None
    v3: str | None = None
    v4: str | None = None
    v5: str | None = None
    v6: str | None = None

    @property
    def named(self) -> dict[str, str]:
        """The names of columns by role."""
        roles = {role for kind in _ROLES.values() for role in kind}
        return {role: name for role, name in self.model_dump().items() if role in roles and name is not None}


class WalkColumns(Record):
    """The content of ``columns.toml``: a section for each table of a walk."""

    poses: TableColumns = TableColumns()
    sightings: TableColumns = TableColumns()
    wifi: TableColumns = TableColumns()
    ble: TableColumns = TableColumns()
    sensors: TableColumns = TableColumns()
    acc: TableColumns = TableColumns()
    gyro: TableColumns = TableColumns()
    mag: TableColumns = TableColumns()
    pressure: TableColumns = TableColumns()

    def of(self, kind: str) -> TableColumns:
        """The section of a kind of table."""
        section: TableColumns = getattr(self, kind)
        return section

    @property
    def text(self) -> str:
        """The sections that have entries, as TOML."""
        sections = ((kind, columns_toml(self.of(kind))) for kind in type(self).model_fields)
        return "\n".join(f"[{kind}]\n{entries}" for kind, entries in sections if entries)


def candidates(columns: Sequence[str], kind: str) -> dict[str, list[Column]]:
    """The columns of a table that may have each role of a kind of table, by name."""
    return {role: _matching(columns, wanted) for role, wanted in _roles(columns, kind).items()}


def resolved(
    columns: Sequence[str], kind: str, given: TableColumns, file: str, sample: pl.DataFrame | None = None
) -> dict[str, Column]:
    """The columns of a table by role; raises UsageError if a role has several, or one that is needed has none.

    ``given`` decides. Of several times the best known name counts. In ``sample``, some rows, addresses are recognised
    if no name says which column they are in.
    """
    roles, named = _roles(columns, kind), given.named
    if wrong := named.keys() - roles.keys():
        raise UsageError(
            f"{COLUMNS_FILE}: [{kind}] {' and '.join(sorted(wrong))}: a table of {kind} has no such column; expected "
            f"{', '.join(roles)}"
        )
    found = {role: given_column(role, name, columns, kind, file) for role, name in named.items() if name}
    for role, wanted in roles.items():
        matched = [] if role in named else _matching(_free(columns, found), wanted)
        if len(matched) > 1 and role != "time":
            matched = _of_one_family(matched, role, columns, found)
            if len(matched) > 1:
                raise UsageError(f"{file}: {_ambiguous(matched, kind, role)}")
        if matched:
            found[role] = matched[0]
    if sample is not None and "address" in roles and not {"address"} & {*found, *named}:
        holder = address_column(sample.select(_free(columns, found)))
        found |= {} if holder is None else {"address": holder}
    missing = [role for role in _required(kind, found) if role not in found]
    if missing:
        free = _free(columns, found)
        suggested = free[0] if len(free) == len(missing) == 1 else "NAME"
        names = {role: roles[role][0] for role in missing}
        if kind == "poses" and set(_TURN) & set(missing) and (advice := _rotation_advice(columns)):
            raise UsageError(f"{file}: found the columns {shown(columns)}; {advice}")
        raise UsageError(f"{file}: {missing_column(columns, names, kind, suggested)}")
    return found


def rotation_columns(columns: Sequence[str]) -> list[str]:
    """The columns of quaternions, numbered quaternions or angles, of which there are most."""
    quaternion = [column.name for role in _TURN for column in matching_columns(columns, role)]
    numbered = [name for name in columns if _NUMBERED.fullmatch(plain_name(name))]
    angles = [name for name in columns if _ANGLE.fullmatch(plain_name(name))]
    return max(quaternion, numbered, angles, key=len)


def _rotation_advice(columns: Sequence[str]) -> str:
    """What to do if the rotations are numbered quaternions or angles; empty if they are not."""
    names = rotation_columns(columns)
    if len(names) >= 3 and all(_ANGLE.fullmatch(plain_name(name)) for name in names):
        return (
            f"{', '.join(names)} are angles, but quaternions are expected. Convert them, for example with "
            'scipy.spatial.transform.Rotation.from_euler("xyz", angles, degrees=True).as_quat(), in the order of axes '
            "of your tracker, and write the result as qx, qy, qz and qw"
        )
    if len(names) == len(_TURN) and all(_NUMBERED.fullmatch(plain_name(name)) for name in names):
        w, x, y, z = sorted(names)
        return (
            f"the order of {', '.join(sorted(names))} is not known. If {w} is the real part, write to {COLUMNS_FILE}: "
            f'[poses] qw = "{w}", qx = "{x}", qy = "{y}", qz = "{z}"; if {z} is, qx = "{w}", qy = "{x}", qz = "{y}", '
            f'qw = "{z}"'
        )
    return ""


def _ambiguous(matched: Sequence[Column], kind: str, role: str) -> str:
    names = " and ".join(each.name for each in matched)
    entry = f"{role} = {toml_value(matched[0].name)}"
    return f"the columns {names} may both be {role}; choose one in {COLUMNS_FILE}: [{kind}] {entry}"


def _required(kind: str, found: Mapping[str, Column]) -> list[str]:
    """The roles that a table must have; sightings have a position or an offset, of which one may be there in part."""
    needed = [role for role in _ROLES[kind] if role in _REQUIRED[kind]]
    if kind != "sightings":
        return needed
    return [*needed, *max(_POSITIONS, key=lambda axes: len(found.keys() & set(axes)))]


def kind_of(file: str, columns: Sequence[str], sample: pl.DataFrame | None = None) -> str | None:
    """The kind of a table by its columns and its file's name; None if it is unknown.

    In ``sample``, some rows, addresses are recognised if no name says which column they are in.
    """
    if sample is not None and not matching_columns(columns, "beacon_address") and address_column(sample) is not None:
        columns = [*columns, "address"]
    if _is(columns, "poses") and (not _is(columns, "sightings") or named_as_poses(file)):
        return "poses"
    if _is(columns, "sightings"):
        return "sightings"
    if _is(columns, "wifi") or _is(columns, "ble"):
        of_beacons = _BLE_FILE.search(file) or not _is(columns, "wifi") or matching_columns(columns, "uuid")
        return "ble" if of_beacons else "wifi"
    return "sensors" if _is(columns, "sensors") else None


def fits(columns: Sequence[str], kind: str, given: TableColumns) -> bool:
    """Whether a table has the columns that a section of columns.toml names, and the others that its kind needs."""
    named = given.named
    there = {name for name in named.values() if name} <= set(columns)
    return bool(named) and there and not set(_missing(columns, kind)) - named.keys()


def unknown_kind(columns: Sequence[str]) -> str:
    """Say which columns a table of no known kind has, and which are expected for the kind that is closest."""
    missing = {kind: _missing(columns, kind) for kind in ("poses", "wifi", "ble", "sightings", "sensors")}
    kind = min(missing, key=lambda each: len(missing[each]) / len(_REQUIRED[each]))
    if len(missing[kind]) * 2 > len(_REQUIRED[kind]):
        return f'found the columns {shown(columns)}; name the file in {COLUMNS_FILE}: [wifi] file = "NAME"'
    names = {role: _ROLES[kind][role][0] for role in missing[kind]}
    return f"as a table of {kind}: {missing_column(columns, names, kind)}"


def _missing(columns: Sequence[str], kind: str) -> list[str]:
    found = {role: matched[0] for role, matched in candidates(columns, kind).items() if matched}
    return [role for role in _required(kind, found) if role not in found]


def named_as_poses(file: str) -> bool:
    """Whether a file's name is that of a table of poses."""
    return bool(_POSE_FILE.search(file)) and not is_of_sightings(file)


def is_of_sightings(file: str) -> bool:
    """Whether a file's name is that of a table of sightings."""
    return bool(_SIGHTING_FILE.search(file))


def sensor_of_file(file: str, columns: Sequence[str]) -> str | None:
    """The sensor of a table that a file's name states, as ``gyroscope.csv`` with x, y and z; None if it is none."""
    words = re.split(r"[^a-z]+", re.sub(r"([a-z])([A-Z])", r"\1 \2", file.rpartition(".")[0]).lower())
    if _NOT_RAW & set(words):
        return None
    names = {*words, "".join(words)}
    kind = next((kind for kind, known in _SENSOR_NAMES.items() if names & set(known.split())), None)
    return kind if kind is not None and _is(columns, kind) else None


_ANGLE = re.compile(r"(?:roll|pitch|yaw|heading|azimuth)(?:deg|rad|degrees|radians|angle)?")
_NUMBERED = re.compile(r"q(?:uat|uaternion)?[0-4]")
_POSE_FILE = re.compile(r"pose|traj|odom|slam", re.IGNORECASE)
_SIGHTING_FILE = re.compile(r"sight|landmark|marker|tag|initpose|detection|observ", re.IGNORECASE)
_BLE_FILE = re.compile(r"ble|blue|beacon", re.IGNORECASE)
_NOT_RAW = frozenset({"uncalibrated", "uncalib", "linear", "user", "un"})
"""Words for readings that are not what a sensor measured, or without its calibration."""


def _roles(columns: Sequence[str], kind: str) -> Mapping[str, tuple[str, ...]]:
    """The roles of a kind of table with their names; the values of sensors count from 0, from 1, or are axes."""
    if kind != "sensors" and kind not in SENSORS:
        return _ROLES[kind]
    counted = [[f"value_{i}" for i in range(first, first + 6)] for first in (0, 1)]
    styles = (*counted, ["value_x", "value_y", "value_z"])
    names = next((style for style in styles if matching_columns(columns, style[0])), ["only_value"])
    return {**_ROLES[kind], **{f"v{i}": (name,) for i, name in enumerate(names, 1)}}


def _matching(columns: Sequence[str], wanted: Sequence[str]) -> list[Column]:
    return next((matched for role in wanted if (matched := matching_columns(columns, role))), [])


def _free(columns: Sequence[str], found: Mapping[str, Column]) -> list[str]:
    taken = {each.name for each in found.values()}
    return [name for name in columns if name not in taken]


def _is(columns: Sequence[str], kind: str) -> bool:
    """Whether there is a column for each role that a kind of table needs."""
    roles = _roles(columns, kind)

    def has(role: str) -> bool:
        return bool(_matching(columns, roles[role]))

    return all(map(has, _REQUIRED[kind])) and (kind != "sightings" or not _missing(columns, kind))


def _of_one_family(
    matched: list[Column], role: str, columns: Sequence[str], found: Mapping[str, Column]
) -> list[Column]:
    """Of several columns for an axis those of the axes found before, else those whose other axes are there, too.

    ``x`` of a picture has no z.
    """
    if role[-1] not in "xyzw":
        return matched
    others = [role[:-1] + axis for axis in ("xyzw" if role.startswith("q") else "xyz") if axis != role[-1]]
    before = {other: plain_name(found[other].name) for other in others if other in found}
    there = {plain_name(name) for name in columns}

    def is_whole(name: str) -> bool:
        return all(
            _renamed(name, role[-1], other[-1]) & ({before[other]} if other in before else there) for other in others
        )

    return [each for each in matched if is_whole(each.name)] or matched


def _renamed(name: str, axis: str, other: str) -> set[str]:
    """The names that a column for another axis has."""
    plain = plain_name(name)
    return {plain[:i] + other + plain[i + 1 :] for i, letter in enumerate(plain) if letter == axis}
