"""Recognise the columns of tables of other programs by name and content, or as the user names them in columns.toml.

A role is a meaning that a column may have (``x``, ``time``, ``address``); its known names are in :data:`KNOWN_NAMES`.
"""

from __future__ import annotations

import re
from collections.abc import Collection, Iterable, Mapping, Sequence
from dataclasses import dataclass
from difflib import get_close_matches
from pathlib import Path
from typing import Literal

import polars as pl
from pydantic import Field

from vislam2tag.common.errors import SurveyError, UsageError
from vislam2tag.common.files.toml_file import read_toml, toml_value
from vislam2tag.common.records import Record
from vislam2tag.intake.cells import length_unit, without_unit
from vislam2tag.intake.readings import is_address

COLUMNS_FILE = "columns.toml"
EAST = "e east easting ost ostwert rechts rechtswert rw ecoord xcoord xcoordinate xpos xposition posx"
NORTH = "n north northing nord nordwert hoch hochwert hw ncoord ycoord ycoordinate ypos yposition posy"
HEIGHT = "h height elevation altitude hoehe höhe zcoord zcoordinate zpos posz"
FLOOR = "storey story etage stockwerk geschoss stock ebene floornumber"
"""Names of coordinates and floors, also in the tables of a site."""
_TRACKER = "p{0} t{0} pos{0} position{0} translation{0} trans{0} pose{0} poseposition{0} poseposeposition{0} coord{0}"
_TRACKER += " posetranslation{0} coordinate{0} loc{0} location{0} local{0} cam{0} camera{0} campos{0} cameraposition{0}"
_TRACKER += " tracker{0} world{0} map{0} odom{0} gt{0} true{0} prsr{0} {0}m"
_TURN = "rot{0} rotation{0} quat{0} quaternion{0} orientation{0} ori{0} poseorientation{0} poseposeorientation{0} o{0}"
_TURN += " poserotation{0} cameraorientation{0} q{0}rot qrs{0} r{0}"
KNOWN_NAMES: Mapping[str, tuple[str, ...]] = {
    role: (role, *words.split())
    for role, words in {
        "x": f"{EAST} {_TRACKER.format('x')}",
        "y": f"{NORTH} {_TRACKER.format('y')}",
        "z": f"{HEIGHT} {_TRACKER.format('z')}",
        "latitude": "lat breite breitengrad currentlatitude",
        "longitude": "lon long lng länge laenge längengrad laengengrad currentlongitude",
        "floor": f"floorid floornum floornr floorno floorindex floorlevel floorname flr {FLOOR}",
        "building": "buildingid buildingname bldg bldgid gebäude gebaeude gebäudeid site siteid",
        "room": "roomid roomname raum raumnummer zimmer space spaceid spot location place",
        "time": (
            "timens timestamp timestamps stamp datetime t when unixtime epoch zeit secondselapsed firstseen timeutc "
            "utc utctime unix systemtime writetime localtime recordedat createdat scantime timeofday zeitstempel "
            "elapsed elapsedtime elapsedrealtime timestampns date datum"
        ),
        "address": (
            "bssid mac macaddress macaddr bssidmac apmac apbssid wifimac wlanmac wifibssid routermac address addr "
            "adresse beacon beaconid apid ap"
        ),
        "level": "rssidbm rssi rss dbm signal signalstrength signallevel strength power rxpower pegel rssivalue",
        "ssid": "networkname essid network wifiname netzname",
        "frequency": "frequencymhz freq freqmhz frequencyinmhz frequenz centerfreq",
        "technology": "tech type radiotype networktype signaltype radio",
        "scan": (
            "scanid scanno scannr scannumber scanindex fingerprint fingerprintid fp fpid sampleid sample rep "
            "repetition messung"
        ),
        "device": "deviceid devicename devicemodel phone phoneid phonetype phonemodel model gerät geraet smartphone",
        "user": "userid username person personid collector nutzer participant subject",
        "session": (
            "sessionid trajectory trajectoryid traj trajid walk walkid walkno walknr track trackid run runid runno "
            "runnr path pathid begehung"
        ),
        "split": "set subset dataset part partition fold usage",
        "landmark": "landmarkid marker markerid tag tagid sheet sheetid code qr qrcode aruco arucoid marke",
        "qx": _TURN.format("x"),
        "qy": _TURN.format("y"),
        "qz": _TURN.format("z"),
        "qw": _TURN.format("w"),
        "uuid": "beaconuuid proximityuuid ibeaconuuid",
        "major": "beaconmajor",
        "minor": "beaconminor",
    }.items()
}
"""Names of each role in normal form (:func:`plain_name`); those that are looked for first come first."""
_OFFSET = "d{0} off{0} offset{0} rel{0} relative{0} cam{0} camera{0} incamera{0} camoffset{0} c{0} {0}offset {0}rel"
_OFFSET += " {0}relative {0}cam {0}camera {0}incamera {0}c"
_LANDMARK = "landmark{0} marker{0} tag{0} landmarkposition{0} markerposition{0} tagposition{0} l{0} m{0}"
WALK_NAMES: Mapping[str, tuple[str, ...]] = {
    role: tuple(words.split())
    for role, words in {
        **{f"pose_{axis}": f"{axis} {_TRACKER.format(axis)} {axis}pos {axis}position {axis}coord" for axis in "xyz"},
        **{f"landmark_{axis}": _LANDMARK.format(axis) for axis in "xyz"},
        **{f"offset_{axis}": _OFFSET.format(axis) for axis in "xyz"},
        "landmark_id": f"{' '.join(KNOWN_NAMES['landmark'])} id name landmarkname markername tagname markernr tagnr",
        "beacon_address": (
            f"{' '.join(KNOWN_NAMES['address'])} id deviceid deviceaddress devicemac blemac bleaddress beaconmac "
            "beaconaddress bluetoothmac bluetoothaddress"
        ),
        "beacon_name": "name devicename localname beaconname",
        "uuid": "uuid beaconuuid proximityuuid",
        "major": "major",
        "minor": "minor",
        "sensor_type": "type sensor sensortype sensorname name kind",
        **{f"value_{i}": f"v{i} value{i} val{i} values{i}" for i in range(7)},
        **{f"value_{axis}": f"{axis} v{axis} val{axis} value{axis}" for axis in "xyz"},
        "only_value": "value values val v",
    }.items()
}
"""Names of roles that only tables of walks have, or for which these use other names."""
_NAMES = {**KNOWN_NAMES, **WALK_NAMES}
LENGTHS = frozenset("xyz") | {f"{role}_{axis}" for role in ("pose", "landmark", "offset") for axis in "xyz"}
"""Roles whose names may state a unit of length."""
TIME = "time"
_TIME_UNITS = {
    **dict.fromkeys(("s", "sec", "secs", "seconds"), "s"),
    **dict.fromkeys(("ms", "msec", "millis", "milliseconds"), "ms"),
    **dict.fromkeys(("us", "usec", "micros", "microseconds"), "us"),
    **dict.fromkeys(("ns", "nsec", "nanos", "nanoseconds"), "ns"),
}
_LONG_UNITS = "|".join(unit for unit in _TIME_UNITS if len(unit) > 1)
_UNIT = re.compile(rf"(.*?)(?:[\s_.-]*[\[(]\s*(s|{_LONG_UNITS})\s*[\])]|[\s_.-]+(s|{_LONG_UNITS})|({_LONG_UNITS}))")
"""``timestamps`` is a plural, ``time_s`` states a unit."""
_LEVEL_UNIT = re.compile(r"(.+?)[ _]?[\[(]?dbm[\])]?", re.IGNORECASE)
_BRACKETS = re.compile(r"(.+?)\s*[\[(][^\])]*[\])]")
_LONGEST_NAME = 200
"""No column with a meaning has a longer name; a damaged file's may have millions of characters."""
_NOT_IN_NAMES = re.compile(r"[^a-z0-9äöüß]")
_EXAMPLES = 4
_SHOWN = 12
"""Columns of a table that a message names."""


def plain_name(text: str) -> str:
    """The normal form of a name: lower case, letters and digits only."""
    return _NOT_IN_NAMES.sub("", text.lower())


@dataclass(frozen=True)
class Column:
    """A column that was found for a role."""

    name: str
    unit: str | None = None
    """Unit of time in its name: ``s``, ``ms``, ``us`` or ``ns``; None if there is none."""
    metres: float | None = None
    """Metres in the unit of length in its name; None if there is none."""
    why: str = "its name"
    """How it was recognised, in words."""


class ColumnNames(Record):
    """The content of a ``columns.toml``: which column has which role, and what its values mean.

    An empty name states that the table has no such column.
    """

    x: str | None = None
    y: str | None = None
    z: str | None = None
    latitude: str | None = None
    longitude: str | None = None
    floor: str | None = None
    building: str | None = None
    room: str | None = None
    time: str | None = None
    address: str | None = None
    level: str | None = None
    ssid: str | None = None
    frequency: str | None = None
    technology: str | None = None
    scan: str | None = None
    device: str | None = None
    user: str | None = None
    session: str | None = None
    split: str | None = None
    landmark: str | None = None
    qx: str | None = None
    qy: str | None = None
    qz: str | None = None
    qw: str | None = None
    uuid: str | None = None
    major: str | None = None
    minor: str | None = None
    """The identity of a BLE beacon, instead of its address."""
    access_points: tuple[str, ...] | str | None = None
    """Columns of levels, one for each access point: names, or patterns such as ``AP*``."""
    not_heard: float | None = None
    """The number that means "not heard"."""
    levels: tuple[tuple[float, float], tuple[float, float]] | None = None
    """Two numbers with their levels in dBm, if the table has another scale."""
    cell: str | None = None
    """Column of cells of a grid, such as ``O02``: x grows with the letter, y with the number, from 0."""
    cell_m: float | None = Field(default=None, gt=0)
    """Distance between neighbouring cells, metres."""
    origin: tuple[float, float] | None = None
    """Latitude and longitude at which x and y are 0, degrees."""
    length_unit: str | None = None
    """Unit of x, y and z, such as ``ft``; metres by default."""
    time_unit: Literal["s", "ms", "us", "ns"] | None = None
    zone: str | None = None
    """Time zone of times without one, such as ``Europe/Berlin``."""

    @property
    def named(self) -> dict[str, str]:
        """The names of columns by role."""
        return {role: name for role in (*KNOWN_NAMES, "cell") if (name := getattr(self, role)) is not None}

    @property
    def metres(self) -> float | None:
        """Metres in the stated unit of length; raises UsageError if it is unknown."""
        if self.length_unit is None:
            return None
        metres = length_unit(self.length_unit)
        if metres is None:
            raise UsageError(f"columns.toml: length_unit = {self.length_unit!r} is unknown; use m, cm, ft or the like")
        return metres


def read_columns_file(path: Path) -> ColumnNames:
    """Read a ``columns.toml``; raises UsageError if it is missing or has a wrong entry."""
    try:
        return read_toml(path, ColumnNames)
    except FileNotFoundError as error:
        raise UsageError(f'{path}: no such file; expected lines such as x = "ECoord"') from error
    except SurveyError as error:
        raise UsageError(str(error)) from error


def columns_toml(names: Record) -> str:
    """Write the stated entries of a ``columns.toml``, or of a section."""
    entries = names.model_dump(exclude_none=True)
    return "".join(f"{key} = {toml_value(value)}\n" for key, value in entries.items())


def is_known(name: str) -> bool:
    """Whether a name is one of a role, with or without a unit."""
    return any(_matched(name, role) is not None for role in KNOWN_NAMES)


def find_columns(
    columns: Sequence[str],
    roles: Iterable[str],
    given: Mapping[str, str] | None = None,
    sample: pl.DataFrame | None = None,
) -> dict[str, Column]:
    """Find the columns of some roles; roles without a column are not in the result.

    ``given`` has names by role, which count first; an empty one states that there is no such column. ``sample`` are
    some rows, in which addresses are recognised if no name says which column they are in. Raises UsageError if the
    table does not have a given column, or if one is given for two roles.
    """
    wanted = list(roles)
    named = {role: name for role, name in (given or {}).items() if role in wanted}
    for role, name in named.items():
        twice = next((other for other, its in named.items() if its == name and other != role), None)
        if name and twice is not None:
            raise UsageError(
                f'columns.toml: {role} = "{name}" and {twice} = "{name}": a column has one meaning; correct one of them'
            )
    found = {role: given_column(role, name, columns) for role, name in named.items() if name}
    for role in wanted:
        free = [name for name in columns if all(name != each.name for each in found.values())]
        if role not in named and (matched := matching_columns(free, role)):
            found[role] = matched[0]
    if sample is not None and "address" in wanted and not {"address"} & {*found, *named}:
        holder = address_column(sample.drop([each.name for each in found.values() if each.name in sample.columns]))
        if holder is not None:
            found["address"] = holder
    return {role: found[role] for role in wanted if role in found}


def matching_columns(columns: Iterable[str], role: str) -> list[Column]:
    """The columns with a name of a role (in :data:`KNOWN_NAMES` or :data:`WALK_NAMES`), the best name first."""
    matched = [found for name in columns if (found := _matched(name, role)) is not None]
    return [column for _, column in sorted(matched, key=lambda each: each[0])]


def address_column(sample: pl.DataFrame) -> Column | None:
    """The one column of some rows whose cells are addresses; None if there is none, or several."""
    names = [name for name in sample.columns if _are_addresses(sample[name])]
    return Column(names[0], why="its addresses") if len(names) == 1 else None


def missing_column(
    columns: Sequence[str], missing: Mapping[str, str] | Collection[str], section: str = "", suggested: str = "NAME"
) -> str:
    """Say which columns a table has, and which names are expected for the ``missing`` roles.

    ``missing`` may map roles to those that have their names. ``section`` is that of columns.toml, and ``suggested``
    the column that could be meant.
    """
    names = missing if isinstance(missing, Mapping) else {role: role for role in missing}
    expected = "; ".join(f"expected for {role} one of {', '.join(_examples(of))}" for role, of in names.items())
    entries = ", ".join(f"{role} = {toml_value(suggested)}" for role in names)
    where = f"[{section}] " if section else ""
    return f"found the columns {shown(columns)}; {expected}; name the column in columns.toml: {where}{entries}"


def shown(columns: Sequence[str]) -> str:
    """The first columns of a table, for a message."""
    names = ", ".join(name[:40] for name in columns[:_SHOWN])
    return f"{names}, ... ({len(columns)} columns)" if len(columns) > _SHOWN else names


def _examples(role: str) -> tuple[str, ...]:
    return _NAMES[role][:_EXAMPLES]


def given_column(role: str, name: str, columns: Sequence[str], section: str = "", table: str = "") -> Column:
    """The column that a (section of) columns.toml names for a role; raises UsageError if the ``table`` has none."""
    if name not in columns:
        lower = {column.lower(): column for column in columns}
        near = get_close_matches(name.lower(), lower, 1, 0.0)
        closest = f" (the closest name is {lower[near[0]]})" if near else ""
        where = f"[{section}] " if section else ""
        missing = f"{table} has no such column" if table else "there is no such column"
        raise UsageError(f'columns.toml: {where}{role} = "{name}": {missing}{closest}; found {shown(columns)}')
    metres = without_unit(name.lower())[1] if role in LENGTHS or role in ("dx", "dy", "dz") else None
    return Column(name, time_unit(name), metres, "columns.toml")


def _matched(name: str, role: str) -> tuple[int, Column] | None:
    """The place of a name in the list of a role, with the unit that it states."""
    if len(name) > _LONGEST_NAME:
        return None
    known, plain = _NAMES[role], plain_name(name)
    if role in LENGTHS:
        without, metres = without_unit(name.strip().lower())
        if metres is not None and (short := plain_name(without)) in known:
            return known.index(short), Column(name, metres=metres)
    if role == TIME and (parts := _unit_match(name)) is not None and (short := plain_name(parts[1])) in known:
        return known.index(short), Column(name, time_unit(name))
    if plain in known:
        return known.index(plain), Column(name)
    pattern = _LEVEL_UNIT if role == "level" else _BRACKETS
    if (match := pattern.fullmatch(name.strip())) and (short := plain_name(match[1])) in known:
        return known.index(short), Column(name)
    return None


def time_unit(name: str) -> str | None:
    """The unit that the name of a column of times states, as in ``time_ms`` or ``t [s]``: s, ms, us or ns."""
    match = _unit_match(name)
    return None if match is None else _TIME_UNITS[next(unit for unit in match.groups()[1:] if unit)]


def _unit_match(name: str) -> re.Match[str] | None:
    return _UNIT.fullmatch(name.strip().lower().replace("µ", "u"))


def _are_addresses(values: pl.Series) -> bool:
    texts = [text for text in values.cast(pl.String).drop_nulls().to_list() if text.strip()]
    return bool(texts) and sum(map(is_address, texts)) >= 0.9 * len(texts)
