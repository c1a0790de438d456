"""Recognise the tables of a walk and their columns by name, or as ``columns.toml`` names them.

A table has a kind (poses, sightings, wifi, ble, sensors, or one sensor), its columns have roles. No file is read here.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from difflib import get_close_matches
from typing import Literal

from vislam2tag.common.errors import UsageError
from vislam2tag.common.files.toml_file import toml_value
from vislam2tag.common.records import Record

COLUMNS_FILE = "columns.toml"
_TIME_UNITS = {
    **dict.fromkeys(("s", "sec", "secs", "seconds"), "s"),
    **dict.fromkeys(("ms", "millis", "milliseconds", "msec"), "ms"),
    **dict.fromkeys(("us", "micros", "microseconds", "usec"), "us"),
    **dict.fromkeys(("ns", "nanos", "nanoseconds", "nsec"), "ns"),
}
_TIME = r"(?:t|time|timestamp|stamp|timestamps|datetime|unixtime|unix|utctime|epoch|zeit"
_TIME += r"|elapsed|elapsedtime|elapsedrealtime|firstseen)"
_UNIT = f"(?:{'|'.join(_TIME_UNITS)})"
_POSITION = (
    r"(?:p|t|pos|position|translation|trans|pose|poseposition|poseposeposition|posetranslation|prsr|loc|location|coord|"
    r"coordinate|cam|camera|cameraposition|campos|tracker|world|map|local|odom)?"
)
_TURN = (
    r"(?:q|quat|quaternion|rot|rotation|orientation|ori|qrs|o|r|poseorientation|poseposeorientation|poserotation|"
    r"cameraorientation)"
)
_LANDMARK = rf"(?:landmark|marker|tag|l|m|landmarkposition|markerposition|tagposition|{_POSITION[3:-2]})?"
_OFFSET = r"(?:d|off|offset|rel|relative|cam|camera|incamera|c|camoffset)"
_BEHIND = r"(?:offset|rel|relative|cam|camera|incamera|c)"


def _axes(before: str, names: str = "xyz", to: str = "") -> dict[str, str]:
    return {f"{to}{axis}": f"{before}{axis}" for axis in names}


_ROLES: Mapping[str, Mapping[str, str]] = {
    "poses": {"time": f"{_TIME}{_UNIT}?", **_axes(_POSITION), **_axes(_TURN, "xyzw", "q")},
    "sightings": {
        "time": f"{_TIME}{_UNIT}?",
        "id": r"(?:id|name|(?:landmark|marker|tag|code|qr|qrcode|aruco|apriltag|sheet)(?:id|name|nr|number)?|marke)",
        **_axes(_LANDMARK),
        **_axes(_TURN, "xyzw", "q"),
        **{f"d{axis}": f"{_OFFSET}{axis}|{axis}{_BEHIND}" for axis in "xyz"},
    },
    "wifi": {
        "time": f"{_TIME}{_UNIT}?",
        "address": r"(?:ap|router|wifi|wlan)?(?:bssid|mac|macaddress|macaddr|address|addr)|ap|apid",
        "level": r"(?:rssi|rss|level|dbm|signal|signalstrength|signallevel|strength|power|rxpower|pegel)(?:dbm)?",
        "ssid": r"ssid|essid|network|networkname|wifiname|netzname",
        "scan": r"(?:scan|fingerprint|sample)(?:id|no|nr|number|index)?",
        "frequency": r"(?:freq|frequency|frequenz)(?:mhz)?",
    },
    "ble": {
        "time": f"{_TIME}{_UNIT}?",
        "address": r"(?:ble|beacon|device|bluetooth)?(?:mac|macaddress|macaddr|address|addr|id)|beacon",
        "level": r"(?:rssi|rss|level|dbm|signal|signalstrength|strength|power|rxpower|pegel)(?:dbm)?",
        "name": r"name|(?:device|local|beacon)name",
        "uuid": r"(?:beacon|proximity)?uuid",
        "major": "major",
        "minor": "minor",
    },
    "sensors": {
        "time": f"{_TIME}{_UNIT}?",
        "type": r"(?:sensor)?(?:type|name)|sensor|kind",
        **{
            f"v{i + 1}": rf"(?:v|value|val|values){number}|(?:v|value|val)?{axis}"
            for i, (number, axis) in enumerate((("(?:1|0(?!.))", "x"), ("2", "y"), ("3", "z")))
        },
    },
}
_REQUIRED = {
    "poses": ("time", "x", "y", "z", "qx", "qy", "qz", "qw"),
    "sightings": ("time", "id"),
    "wifi": ("time", "address", "level"),
    "ble": ("time", "address", "level"),
    "sensors": ("time", "type", "v1"),
}
SENSORS = ("acc", "gyro", "mag", "pressure")
"""Kinds of tables, or of their columns, that are one sensor."""
_EXAMPLES = {
    "time": "time, timestamp, t, time_ms",
    "x": "x, tx, px, pos_x", "y": "y, ty, py, pos_y", "z": "z, tz, pz, pos_z",
    "qx": "qx, quat_x, rot_x", "qy": "qy, quat_y, rot_y", "qz": "qz, quat_z, rot_z", "qw": "qw, quat_w, rot_w",
    "id": "id, landmark, marker_id, tag",
    "dx": "dx, offset_x, cam_x", "dy": "dy, offset_y, cam_y", "dz": "dz, offset_z, cam_z",
    "address": "bssid, mac, address", "level": "rssi, rss, level, dbm",
    "type": "type, sensor", "v1": "v1, value1, x",
}  # fmt: skip
_SHOWN = 20
_LONGEST_NAME = 200


class TableColumns(Record):
    """A section of ``columns.toml``: the file of a table and the names of its columns by role."""

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
    name: str | None = None
    uuid: str | None = None
    major: str | None = None
    minor: str | None = None
    type: str | None = None
    v1: str | None = None
    v2: str | None = None
    v3: str | None = None


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
        parts = []
        for kind in type(self).model_fields:
            entries = {key: value for key, value in self.of(kind).model_dump().items() if value is not None}
            if entries:
                parts.append(
                    "\n".join((f"[{kind}]", *(f"{key} = {toml_value(value)}" for key, value in entries.items()), ""))
                )
        return "\n".join(parts)


def plain_name(name: str) -> str:
    """The normal form of a name: lower case, no unit in brackets, letters and digits only."""
    return re.sub(r"[^a-z0-9]", "", re.sub(r"[\[(].*?[\])]", "", name.lower()))


def time_unit(name: str) -> str | None:
    """The unit of time that a name states, as in ``time_ms`` or ``t [s]``: ``s``, ``ms``, ``us`` or ``ns``."""
    lower = name.strip().lower().replace("µ", "u")
    bracketed = re.search(r"[\[(]\s*([a-z]+)\s*[\])]$", lower)
    if bracketed:
        return _TIME_UNITS.get(bracketed[1])
    behind = re.search(rf"(?:[ _.-]|time|stamp)({_UNIT})$", lower)
    return None if behind is None else _TIME_UNITS[behind[1]]


def candidates(columns: Sequence[str], kind: str) -> dict[str, list[str]]:
    """The columns of a table that may have each role of a kind of table, by name."""
    plain = {name: plain_name(name) for name in columns if len(name) <= _LONGEST_NAME}
    return {
        role: [name for name, short in plain.items() if re.fullmatch(pattern, short)]
        for role, pattern in _ROLES[kind].items()
    }


def resolved(columns: Sequence[str], kind: str, given: TableColumns, file: str) -> dict[str, str]:
    """The columns of a table by role; raises UsageError if a role has several, or one that is needed has none.

    ``given`` decides; an empty name states that there is no such column.
    """
    known, found = candidates(columns, kind), dict[str, str]()
    given_names = {role: name for role in known if (name := getattr(given, role)) is not None}
    for role, name in given_names.items():
        if name and name not in columns:
            raise UsageError(_unknown_column(file, kind, role, name, columns))
    taken = {name for name in given_names.values() if name}
    for role, names in known.items():
        free = _of_one_family([name for name in names if name not in taken], role, known)
        if role in given_names:
            free = [name for name in (given_names[role],) if name]
        elif role == "time":
            free = free[:1]
        if len(free) > 1:
            both = " and ".join(f"`{name}`" for name in free)
            raise UsageError(
                f"{file}: the columns {both} may both be {role}; choose one in {COLUMNS_FILE}: "
                f'[{kind}] {role} = "{free[0]}"'
            )
        if free:
            found[role] = free[0]
    missing = [role for role in _REQUIRED[kind] if role not in found]
    if kind == "sightings" and not {"x", "y", "z"} <= found.keys() and not {"dx", "dy", "dz"} <= found.keys():
        missing += [role for role in "xyz" if role not in found]
    if missing:
        raise UsageError(
            missing_columns(file, kind, missing, [name for name in columns if name not in found.values()], columns)
        )
    return found


def _of_one_family(names: list[str], role: str, known: Mapping[str, list[str]]) -> list[str]:
    """Of several columns for an axis those whose other axes are there, too: ``x`` of a picture has no z."""
    if len(names) < 2 or role[-1] not in "xyzw" or role == "time":
        return names
    others = [other for other in known if other[:-1] == role[:-1] and other != role]
    whole = [
        name
        for name in names
        if all(
            any(
                plain_name(name).replace(role[-1], "@") == plain_name(each).replace(other[-1], "@")
                for each in known[other]
            )
            for other in others
        )
    ]
    return whole or names


def missing_columns(file: str, kind: str, missing: Iterable[str], free: Sequence[str], columns: Sequence[str]) -> str:
    """Say which columns a table has and which names are expected."""
    roles = list(missing)
    expected = "; ".join(f"for {role} one of {_EXAMPLES.get(role, role)}" for role in roles)
    entries = ", ".join(f'{role} = "{free[0] if len(free) == 1 else "NAME"}"' for role in roles)
    return (
        f"{file}: found the columns {shown(columns)}; expected {expected}; name them in {COLUMNS_FILE}: "
        f"[{kind}] {entries}"
    )


def shown(columns: Sequence[str]) -> str:
    """The first columns of a table, for a message."""
    names = ", ".join(f"`{name[:40]}`" for name in columns[:_SHOWN])
    return f"{names}, ... ({len(columns)} columns)" if len(columns) > _SHOWN else names or "none"


def _unknown_column(file: str, kind: str, role: str, name: str, columns: Sequence[str]) -> str:
    lower = {column.lower(): column for column in columns}
    near = [lower[each] for each in get_close_matches(name.lower(), lower, 1, 0.0)]
    closest = f" (the closest name is {near[0]})" if near else ""
    return f'{COLUMNS_FILE}: [{kind}] {role} = "{name}": {file} has no such column{closest}; found {shown(columns)}'


_POSE_FILE = re.compile(r"pose|traj|odom|slam", re.IGNORECASE)
_SIGHTING_FILE = re.compile(r"sight|landmark|marker|tag|initpose|detection|observ", re.IGNORECASE)
_BLE_FILE = re.compile(r"ble|blue|beacon", re.IGNORECASE)
_SENSOR_FILES = {
    "acc": re.compile(r"acc", re.IGNORECASE),
    "gyro": re.compile(r"gyr", re.IGNORECASE),
    "mag": re.compile(r"mag", re.IGNORECASE),
    "pressure": re.compile(r"baro|press", re.IGNORECASE),
}


@dataclass(frozen=True)
class Header:
    """The file's name and the columns of a table."""

    file: str
    columns: tuple[str, ...]

    @property
    def kinds(self) -> tuple[str, ...]:
        """Kinds of the table by its columns and its name; several for a table of several sensors, none if unknown."""
        found = {kind: {role for role, names in candidates(self.columns, kind).items() if names} for kind in _ROLES}
        whole = {kind for kind, roles in found.items() if set(_REQUIRED[kind]) <= roles}
        if "sightings" in whole and not (
            {"x", "y", "z"} <= found["sightings"] or {"dx", "dy", "dz"} <= found["sightings"]
        ):
            whole.discard("sightings")
        of_poses = _POSE_FILE.search(self.file) and not _SIGHTING_FILE.search(self.file)
        if "poses" in whole and ("sightings" not in whole or of_poses):
            return ("poses",)
        if "sightings" in whole:
            return ("sightings",)
        if "wifi" in whole or "ble" in whole:
            return (
                ("ble",) if _BLE_FILE.search(self.file) or "wifi" not in whole or "uuid" in found["ble"] else ("wifi",)
            )
        if "sensors" in whole and not _SENSOR_ONLY.search(self.file):
            return ("sensors",)
        return ()


_SENSOR_ONLY = re.compile(r"truth|fixes", re.IGNORECASE)


def sensor_of_file(file: str) -> str | None:
    """The sensor that a file's name states, as in ``gyroscope.csv``; None if it states none."""
    return next((sensor for sensor, pattern in _SENSOR_FILES.items() if pattern.search(file)), None)


def named_as_poses(file: str) -> bool:
    """Whether a file's name is that of a table of poses."""
    return bool(_POSE_FILE.search(file)) and not _SIGHTING_FILE.search(file)
