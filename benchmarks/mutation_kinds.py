"""The kinds of semantic mutations: what is changed in which input, and how it must be reported.

``expected`` are kinds of findings or words of a message. A kind without them must be harmless. A kind that no program
can detect has a reason instead, and does not count.
"""

from __future__ import annotations

from dataclasses import dataclass
from datetime import timedelta

import mutation_changes as to
import numpy as np


@dataclass(frozen=True)
class Kind:
    """A change of meaning of one input, and how it must be reported."""

    name: str
    what: str
    input: str
    change: to.Change
    expected: tuple[str, ...] = ()
    undetectable: str = ""


FRAME = ("survey_fault", "landmarks_off_plan", "implausible_extent")
LANDMARK = ("survey_fault", "odd_reference")
EXTENT = ("implausible_extent", "landmarks_off_plan", "survey_fault", "positions span", "positions are more than")
TIME = ("time_unit", "rounded_times")
CLOCK = ("clock_mismatch", "survey_fault")
LEVEL = ("lost_sign", "absurd_levels", "levels_not_dbm", "--levels")
NOT_HEARD = ("unstated_filler", "not-heard")
ADDRESS = ("masked_addresses",)
UNIT = ("sensor_unit", "unknown_unit")
NO_ENTRY = ("unused_correction", "unknown_in_corrections", "corrections.toml")
INTERCHANGED = ("interchanged", "moved_landmark")
CONTRADICTED = ("too long", "excluded", r"\b[1-9]\d* contradiction", r"\b[1-9]\d* without a position")
OFFSET = "phones differ by a constant offset in dB"

_LANDMARKS = (
    Kind("landmarks: x and y exchanged", "x and y of all rows", "survey", to.landmarks(to.exchanged), FRAME),
    Kind("landmarks: cm", "all coordinates", "survey", to.landmarks(to.scaled(100)), FRAME),
    Kind("landmarks: mm", "all coordinates", "survey", to.landmarks(to.scaled(1000)), FRAME),
    Kind("landmarks: feet", "all coordinates", "survey", to.landmarks(to.scaled(1 / to.FT_M)), FRAME),
    Kind("landmarks: kilometres", "all coordinates", "survey", to.landmarks(to.scaled(1e-3)), FRAME),
    Kind("landmarks: degrees", "longitude and latitude", "survey", to.landmarks(to.floats(to.degrees, 8)), FRAME),
    Kind("landmarks: y downwards", "y from the upper edge", "survey", to.sized(lambda x, y, h: (x, h - y)), FRAME),
    Kind(
        "landmarks: pixels",
        "20 pixels a metre, y downwards",
        "survey",
        to.sized(lambda x, y, h: (20 * x, 20 * (h - y))),
        FRAME,
    ),
    Kind(
        "landmarks: national grid",
        "easting and northing",
        "survey",
        to.landmarks(to.floats(lambda x, y: (x + 294_000, y + 5_629_000))),
        (*FRAME, "national grid", "non_finite_values"),
    ),
    Kind(
        "landmarks: quoted decimal commas",
        'coordinates as "12,5"',
        "survey",
        to.quoted_landmarks,
        ("malformed", "decimal"),
    ),
    Kind(
        "landmarks: unquoted decimal commas",
        "coordinates as 12,5",
        "survey",
        to.unquoted("survey/floor_0/marker_dict.csv"),
        ("decimal",),
    ),
    Kind("landmarks: semicolons", "semicolons and decimal commas", "survey", to.landmarks_with_semicolons),
    Kind("landmarks: two exchanged", "ids of two rows", "survey", to.ids_exchanged, LANDMARK),
    Kind("landmarks: one moved", "one place, by 3 m", "survey", to.one_moved, LANDMARK),
    Kind("landmarks: id twice", "a second row of an id, 6 m away", "survey", to.id_twice, ("duplicate_landmarks",)),
    Kind(
        "landmarks: ids shifted",
        "all ids, by one",
        "survey",
        to.landmarks(to.whole(lambda n: n + 1), ("id",)),
        ("shifted_ids", "other_ids", "survey_fault"),
    ),
    Kind(
        "landmarks: other floor",
        "tables of two floors exchanged",
        "storeys",
        to.floors_exchanged,
        (*FRAME, "other_ids"),
    ),
    Kind(
        "landmarks: turned",
        "all places, by 3 degrees and 1 m",
        "survey",
        to.landmarks(to.floats(to.turned_frame)),
        undetectable="a frame that is rotated consistently is another valid frame",
    ),
    Kind(
        "landmarks: shifted",
        "all places, by 1 m",
        "survey",
        to.landmarks(to.floats(lambda x, y: (x + 1, y))),
        undetectable="a frame that is shifted consistently is another valid frame",
    ),
)
_FLOORS = (
    Kind("floor: cm", "width and height", "survey", to.floors(to.scaled(100)), EXTENT),
    Kind("floor: mm", "width and height", "survey", to.floors(to.scaled(1000)), EXTENT),
    Kind("floor: feet", "width and height", "survey", to.floors(to.scaled(1 / to.FT_M)), EXTENT),
    Kind("floor: kilometres", "width and height", "survey", to.floors(to.scaled(1e-3, 9)), EXTENT),
    Kind("floor: degrees", "width and height", "survey", to.floors(to.scaled(1e-5, 9)), EXTENT),
    Kind("floor: exchanged", "width and height", "survey", to.floors(to.exchanged), EXTENT),
    Kind(
        "floor: 5 % too large",
        "width and height",
        "survey",
        to.floors(to.scaled(1.05)),
        undetectable="landmarks and walks fit on a slightly larger plan of the same shape",
    ),
)
_POSES = (
    Kind(
        "poses: x and y exchanged",
        "positions of camera and landmarks",
        "survey",
        to.walked(lambda cells: [cells[1], cells[0], cells[2]]),
        ("x and y .*exchanged", "implausible_poses"),
    ),
    Kind(
        "poses: mm",
        "positions of camera and landmarks",
        "survey",
        to.walked(to.scaled(1000)),
        ("lengths are in millimetres",),
    ),
    Kind(
        "poses: cm",
        "positions of camera and landmarks",
        "survey",
        to.walked(to.scaled(100)),
        ("lengths are in centimetres",),
    ),
    Kind(
        "poses: feet",
        "positions of camera and landmarks",
        "survey",
        to.walked(to.scaled(1 / to.FT_M)),
        ("lengths are in feet", *LANDMARK),
    ),
    Kind("poses: z up", "frame", "survey", to.walked(to.Z_UP, to.WHOLE_POSE), ("the z axis points up",)),
    Kind(
        "poses: w first",
        "order of quaternions",
        "survey",
        to.walked(lambda cells: [cells[3], *cells[:3]], to.QUATERNION),
        ("quaternions begin with the real part",),
    ),
    Kind(
        "poses: inverted",
        "world to camera",
        "survey",
        to.walked(to.floats(to.inverted), to.WHOLE_POSE),
        ("map the world to the camera",),
    ),
    Kind(
        "poses: left-handed",
        "mirrored frame",
        "survey",
        to.walked(to.floats(to.left_handed), to.WHOLE_POSE),
        ("left-handed", "pose_convention", "implausible_poses"),
    ),
    Kind("poses: turned frame", "heading of the tracker's frame", "survey", to.walked(to.YAW, to.WHOLE_POSE)),
    Kind("poses: times in s", "poses and landmarks", "survey", to.times(to.in_seconds, "poses", "log"), TIME),
    Kind(
        "poses: times in ms",
        "poses and landmarks",
        "survey",
        to.times(to.whole(lambda time: time // 10**6), "poses", "log"),
        TIME,
    ),
    Kind(
        "poses: times in us",
        "poses and landmarks",
        "survey",
        to.times(to.whole(lambda time: time // 10**3), "poses", "log"),
        TIME,
    ),
    Kind("poses: spreadsheet times", "rounded exponents", "survey", to.times(to.spreadsheet, "poses", "log"), TIME),
    Kind(
        "poses: frames twice",
        "every row of poses and landmarks",
        "survey",
        to.frames_twice,
        ("duplicate_times", "duplicate_landmark_rows"),
    ),
    Kind(
        "walk: other floor",
        "folder of a walk",
        "storeys",
        to.other_floor,
        ("survey_fault", "other_ids", "landmark_of_other_floor", "pose_convention"),
    ),
    Kind(
        "walk: other device",
        "folder of a walk",
        "survey",
        to.other_device,
        undetectable="phones of a survey may differ in nothing that is logged",
    ),
    Kind("walk: twice", "copy of a walk under another date", "survey", to.copied, ("walk_twice",)),
    Kind(
        "walk: landmarks of another",
        "landmark logs of two walks exchanged",
        "survey",
        to.of_other_walk("initPoses.csv", "LandmarkPose.csv"),
        ("landmark_rows_without_frame", "clock_mismatch"),
    ),
    Kind(
        "walk: Wi-Fi of another",
        "Wi-Fi logs of two walks exchanged",
        "survey",
        to.of_other_walk("wifi.csv", "WiFi.csv"),
        CLOCK,
    ),
    Kind(
        "walk: sensors of another",
        "sensor logs of two walks exchanged",
        "survey",
        to.of_other_walk("sensors.csv", "Sensors.csv"),
        CLOCK,
    ),
    Kind(
        "walk: clock shifted",
        "all times of all tables, by 37 s",
        "survey",
        to.all_shifted,
        undetectable="times since boot have no absolute zero",
    ),
)
_WIFI = (
    Kind("Wi-Fi: positive", "all levels", "survey", to.levels(lambda level: -level), LEVEL),
    Kind("Wi-Fi: 0..1", "levels as shares", "survey", to.levels(lambda level: to.percent(level) / 100, 3), LEVEL),
    Kind("Wi-Fi: percent", "levels as percent", "survey", to.levels(to.percent), LEVEL),
    Kind("Wi-Fi: milliwatts", "levels as powers", "survey", to.levels(lambda level: 10 ** (level / 10), 12), LEVEL),
    Kind(
        "Wi-Fi: with unit",
        'levels as "-60dBm"',
        "survey",
        to.levels(lambda level: f"{level:.0f}dBm"),
        (*LEVEL, "unreadable_cells"),
    ),
    Kind("Wi-Fi: filler 0", "not heard as 0", "survey", to.filled("0"), (*LEVEL, *NOT_HEARD)),
    Kind("Wi-Fi: filler -100", "not heard as -100", "survey", to.filled("-100"), (*LEVEL, *NOT_HEARD)),
    Kind("Wi-Fi: filler -127", "not heard as -127", "survey", to.filled("-127"), (*LEVEL, *NOT_HEARD)),
    Kind("Wi-Fi: offset", "all levels, by 6 dB", "survey", to.levels(lambda level: level - 6), undetectable=OFFSET),
    Kind("Wi-Fi: masked addresses", "all addresses", "survey", to.addresses(lambda _: [to.MASKED]), ADDRESS),
    Kind("Wi-Fi: half masked", "half of all addresses", "survey", to.addresses(to.half_masked), ADDRESS),
    Kind(
        "Wi-Fi: SSID and BSSID exchanged",
        "two columns",
        "survey",
        to.addresses(to.exchanged, (3, 4)),
        ("exchanged_columns",),
    ),
    Kind("Wi-Fi: dashes", "separators in addresses", "survey", to.addresses(to.dashed)),
    Kind(
        "Wi-Fi: stale scans",
        "every second scan repeats the one before",
        "survey",
        to.stale,
        ("stale_scans", "stale_wifi_rows"),
    ),
    Kind(
        "Wi-Fi: other clock",
        "times, by 15 s",
        "survey",
        to.times(to.whole(lambda time: time + 15_000_000), "wifi"),
        CLOCK,
    ),
    Kind(
        "Wi-Fi: Unix times",
        "times since 1970",
        "survey",
        to.times(to.whole(lambda time: time + 1_640_000_000_000_000), "wifi"),
        (*CLOCK, "far_times"),
    ),
    Kind("Wi-Fi: times in ms", "unit of times", "survey", to.times(to.whole(lambda time: time // 1000), "wifi"), TIME),
    Kind("Wi-Fi: spreadsheet times", "rounded exponents", "survey", to.times(to.spreadsheet, "wifi"), TIME),
)
_SENSORS = (
    Kind("sensors: g", "accelerations", "survey", to.sensed("ACC", to.scaled(1 / to.G_M_S2)), UNIT),
    Kind("sensors: deg/s", "turn rates", "survey", to.sensed("GYRO", to.scaled(np.degrees(1))), UNIT),
    Kind(
        "sensors: axes exchanged",
        "x and y of accelerometer and gyroscope",
        "survey",
        to.every(to.sensed("ACC", to.turned_axes), to.sensed("GYRO", to.turned_axes)),
        ("implausible_poses", "pose_convention"),
    ),
    Kind(
        "sensors: other clock",
        "times, by 5 s",
        "survey",
        to.times(to.whole(lambda time: time + 5_000_000_000), "sensors"),
        (*CLOCK, "implausible_poses"),
    ),
    Kind(
        "sensors: times in ms",
        "unit of times",
        "survey",
        to.times(to.whole(lambda time: time // 10**6), "sensors"),
        TIME,
    ),
    Kind("sensors: spreadsheet times", "rounded exponents", "survey", to.times(to.spreadsheet, "sensors"), TIME),
)
_PHONE = (
    Kind("phone: Wi-Fi positive", "all levels", "phone", to.levels(lambda level: -level), LEVEL),
    Kind("phone: BLE positive", "all levels", "phone", to.logged("Ble.csv", to.scaled(-1, 0), "rssi_dbm"), LEVEL),
    Kind(
        "phone: poses in mm",
        "positions of camera and landmarks",
        "phone",
        to.walked(to.scaled(1000), to.PHONE_POSITION),
        ("lengths are in millimetres",),
    ),
    Kind(
        "phone: w first",
        "quaternions of camera and landmarks",
        "phone",
        to.walked(lambda cells: [cells[3], *cells[:3]], to.PHONE_QUATERNION),
        ("quaternions begin with the real part",),
    ),
    Kind("phone: sensors in g", "accelerations", "phone", to.sensed("ACC", to.scaled(1 / to.G_M_S2)), UNIT),
    Kind(
        "phone: Wi-Fi times in us",
        "unit of times",
        "phone",
        to.times(to.whole(lambda time: time // 1000), "wifi"),
        TIME,
    ),
)
_IMPORTS = (
    Kind("import: degrees", "coordinates", "uji", to.uji(to.floats(to.degrees, 8), *to.UJI_PLACE), EXTENT),
    Kind("import: mm", "coordinates", "uji", to.uji(to.scaled(1000), *to.UJI_PLACE), EXTENT),
    Kind("import: kilometres", "coordinates", "uji", to.uji(to.scaled(1e-3, 9), *to.UJI_PLACE), EXTENT),
    Kind("import: positive", "all levels", "uji", to.uji_levels(lambda level: -level), LEVEL),
    Kind("import: percent", "levels as percent, 0 not heard", "uji", to.uji_levels(to.percent, "0"), LEVEL),
    Kind(
        "import: 0..1",
        "levels as shares, 0 not heard",
        "uji",
        to.uji_levels(lambda level: to.percent(level) / 100, "0", 3),
        LEVEL,
    ),
    Kind("import: filler -110", "not heard as -110", "uji", to.uji_levels(lambda level: level, "-110"), NOT_HEARD),
    Kind("import: filler 0", "not heard as 0", "uji", to.uji_levels(lambda level: level, "0"), NOT_HEARD),
    Kind("import: floor 1.0", "floors with a point", "uji", to.uji(to.floats(lambda n: [n], 1), "FLOOR")),
    Kind("import: semicolons", "semicolons and decimal commas", "uji", to.decimal_commas(to.UJI)),
    Kind(
        "import: spreadsheet times",
        "rounded exponents",
        "uji",
        to.uji(to.spreadsheet, "TIMESTAMP"),
        (*TIME, "TIMESTAMP"),
    ),
    Kind(
        "import: times in ms",
        "unit of times",
        "uji",
        to.uji(to.whole(lambda time: time * 1000), "TIMESTAMP"),
        (*TIME, "TIMESTAMP", "unreadable_dates"),
    ),
    Kind(
        "import: coordinates exchanged",
        "longitude and latitude",
        "uji",
        to.uji(to.exchanged, *to.UJI_PLACE),
        undetectable="metres do not show their axis, and the table has no plan",
    ),
    Kind(
        "import: feet",
        "coordinates",
        "uji",
        to.uji(to.scaled(1 / to.FT_M), *to.UJI_PLACE),
        undetectable="a building 3.3 times as large is possible, and the table has no plan",
    ),
    Kind("import: offset", "all levels, by 6 dB", "uji", to.uji_levels(lambda level: level - 6), undetectable=OFFSET),
    Kind("comford: positive", "all levels", "comford", to.comford("RSSI.csv", to.scaled(-1, 0), "rssi"), LEVEL),
    Kind(
        "comford: degrees",
        "coordinates",
        "comford",
        to.comford("Samples.csv", to.floats(to.degrees, 8), "x", "y"),
        EXTENT,
    ),
)
_ACC, _GYRO = tuple(f"acc_{axis}" for axis in "xyz"), tuple(f"gyro_{axis}" for axis in "xyz")
_IN_G = to.table("other.csv", to.scaled(1 / to.G_M_S2), *_ACC)
_IN_DEG = to.table("other.csv", to.scaled(np.degrees(1)), *_GYRO)
_WITH_UNITS = ("Time (s)", *(f"{name} (g)" for name in _ACC), *(f"{name} (deg/s)" for name in _GYRO))
_TABLES = (
    Kind("label: blanks", "blanks behind commas", "label", to.blanks("table.csv")),
    Kind(
        "label: levels with unit",
        'levels as "-60dBm"',
        "label",
        to.table("table.csv", lambda cells: [f"{cells[0]}dBm"], "level_dbm"),
    ),
    Kind(
        "label: N/A",
        "every third time",
        "label",
        to.missing_cells("table.csv", "N/A", ("time_ns",), 3),
        ("unreadable_cells", "N/A"),
    ),
    Kind(
        "label: spreadsheet times",
        "rounded exponents",
        "label",
        to.table("table.csv", to.spreadsheet, "time_ns"),
        ("rounded", "spreadsheet"),
    ),
    Kind(
        "label: ns as s",
        "a column time_s with ns",
        "label",
        to.renamed("table.csv", ("time_s", "co2_ppm", "level_dbm")),
        (*TIME, "unit", "not within any walk"),
    ),
    Kind(
        "label: ms as ns",
        "a column time_ns with ms",
        "label",
        to.table("table.csv", to.whole(lambda time: time // 10**6), "time_ns"),
        (*TIME, "unit", "not within any walk"),
    ),
    Kind("label: winter time", "local dates, set back by an hour", "dates", to.set_back, ("daylight", "set back")),
    Kind(
        "label: other zone",
        "local dates of a zone three hours away",
        "dates",
        to.table("table.csv", to.dates(lambda date: date + timedelta(hours=3)), "datetime"),
        ("zone", "hours?", "0 have a position"),
    ),
    Kind(
        "label: other walk",
        "times of a walk of the next day",
        "label",
        to.table("table.csv", to.whole(lambda time: time + 86_400 * 10**9), "time_ns"),
        ("not within any walk",),
    ),
    Kind(
        "attach: g and deg/s in names",
        "units, as their columns state",
        "attach",
        to.every(_IN_G, _IN_DEG, to.renamed("other.csv", _WITH_UNITS)),
        UNIT,
    ),
    Kind("attach: g", "accelerations", "attach", _IN_G, UNIT),
    Kind("attach: deg/s", "turn rates", "attach", _IN_DEG, UNIT),
    Kind("attach: blanks", "blanks behind commas", "attach", to.blanks("other.csv")),
    Kind(
        "attach: N/A",
        "every third acceleration",
        "attach",
        to.missing_cells("other.csv", "N/A", _ACC, 3),
        ("unreadable_cells", "N/A"),
    ),
    Kind("attach: decimal commas", "with semicolons", "attach", to.decimal_commas("other.csv")),
    Kind(
        "attach: spreadsheet times",
        "Unix times as rounded exponents",
        "attach",
        to.table("other.csv", lambda cells: [f"{1.64e9 + float(cells[0]):.5E}"], 0),
        ("rounded", "spreadsheet"),
    ),
    Kind(
        "attach: another walk",
        "recording of another walk",
        "attach",
        to.foreign,
        ("not clear", "cannot be tied", "counterpart", "correlation"),
    ),
    Kind(
        "attach: axes exchanged",
        "x and y of the gyroscope",
        "attach",
        to.table("other.csv", to.exchanged, *_GYRO[:2]),
        undetectable="the other device may be mounted in any way, so only sizes of turn rates are compared",
    ),
    Kind(
        "attach: positive levels",
        "all levels",
        "attach-wifi",
        to.table("other.csv", to.scaled(-1, 0), "rssi_dbm"),
        LEVEL,
    ),
    Kind(
        "attach: levels with unit",
        'levels as "-60dBm"',
        "attach-wifi",
        to.table("other.csv", lambda cells: [f"{cells[0]}dBm"], "rssi_dbm"),
        (*LEVEL, "unreadable_cells", "dBm"),
    ),
    Kind("attach: dashes", "separators in addresses", "attach-wifi", to.table("other.csv", to.dashed, "bssid")),
    Kind(
        "attach: half masked",
        "half of all addresses",
        "attach-wifi",
        to.table("other.csv", to.half_masked, "bssid"),
        ADDRESS,
    ),
    Kind("locate: positive", "all levels", "scans", to.table("scans.csv", to.scaled(-1, 0), "rssi_dbm"), LEVEL),
    Kind(
        "locate: 0..1",
        "levels as shares",
        "scans",
        to.table("scans.csv", to.floats(lambda level: [to.percent(level) / 100], 3), "rssi_dbm"),
        LEVEL,
    ),
    Kind(
        "locate: percent",
        "levels as percent",
        "scans",
        to.table("scans.csv", to.floats(lambda level: [to.percent(level)], 0), "rssi_dbm"),
        LEVEL,
    ),
    Kind("locate: dashes", "separators in addresses", "scans", to.table("scans.csv", to.dashed, "bssid")),
    Kind(
        "locate: masked addresses",
        "all addresses",
        "scans",
        to.table("scans.csv", lambda _: [to.MASKED], "bssid"),
        (*ADDRESS, to.MASKED),
    ),
)
_CORRECTIONS = (
    Kind(
        "corrections: unknown landmark",
        "an id in no table",
        "survey",
        to.corrected('[[move_landmark]]\nid = "{id}9x"\nx = 1.0\ny = 2.0\n'),
        NO_ENTRY,
    ),
    Kind(
        "corrections: unknown session",
        "a session that does not exist",
        "survey",
        to.corrected('[[exclude_session]]\nsession = "{session}0"\n'),
        NO_ENTRY,
    ),
    Kind(
        "corrections: unknown floor",
        "a floor that does not exist",
        "survey",
        to.corrected('[[exclude_landmark]]\nid = "{id}"\nfloor = 7\n'),
        NO_ENTRY,
    ),
    Kind(
        "corrections: misspelt entry",
        "the name of an entry",
        "survey",
        to.corrected('[[exclude_landmrk]]\nid = "{id}"\n'),
        NO_ENTRY,
    ),
    Kind(
        "corrections: cm",
        "coordinates of a moved landmark",
        "survey",
        to.corrected('[[move_landmark]]\nid = "{id}"\nx = 2130.0\ny = 1120.0\n'),
        (*LANDMARK, *EXTENT),
    ),
)
_MEASURED = (
    Kind("tape: cm", "all distances", "tape", to.table("tape.csv", to.scaled(100, 1), "distance_m"), CONTRADICTED),
    Kind(
        "tape: feet",
        "all distances",
        "tape",
        to.table("tape.csv", to.scaled(1 / to.FT_M, 3), "distance_m"),
        CONTRADICTED,
    ),
    Kind("tape: semicolons", "semicolons and decimal commas", "tape", to.decimal_commas("tape.csv")),
    Kind(
        "tape: quoted decimal commas", 'distances as "1,41"', "tape", to.quoted("tape.csv", "distance_m"), ("decimal",)
    ),
    Kind(
        "tape: unquoted decimal commas",
        "distances as 1,41",
        "tape",
        to.unquoted("tape.csv"),
        ("decimal",),
    ),
    Kind(
        "tape: targets with unquoted decimal commas",
        "coordinates as 1,41",
        "tape",
        to.unquoted("targets.csv"),
        ("decimal",),
    ),
    Kind(
        "station: known points with unquoted decimal commas",
        "coordinates as 1,41",
        "station",
        to.unquoted("control.csv"),
        ("decimal",),
    ),
    Kind("tape: targets with semicolons", "semicolons and decimal commas", "tape", to.decimal_commas("targets.csv")),
    Kind(
        "tape: targets with quoted decimal commas",
        'coordinates as "1,41"',
        "tape",
        to.quoted("targets.csv", "x", "y"),
    ),
    Kind(
        "tape: targets exchanged",
        "names of two corners",
        "tape",
        to.names_exchanged("targets.csv", "K1", "K2"),
        (*CONTRADICTED, "moved_landmark"),
    ),
    Kind(
        "tape: landmarks exchanged",
        "names of two landmarks",
        "tape",
        to.names_exchanged("tape.csv", "1", "2"),
        INTERCHANGED,
    ),
    Kind(
        "station: feet",
        "all coordinates",
        "station",
        to.table("station.csv", to.scaled(1 / to.FT_M, 4), 1, 2),
        ("station_scale", "times as long"),
    ),
    Kind(
        "station: known points in cm",
        "coordinates of known points",
        "station",
        to.table("control.csv", to.scaled(100), 1, 2),
        ("station_scale", "times as long"),
    ),
    Kind(
        "station: E and N exchanged",
        "two columns",
        "station",
        to.table("station.csv", to.exchanged, 1, 2),
        ("mirror", "exchanged", "interchanged", "axes"),
    ),
    Kind(
        "station: landmarks exchanged",
        "names of two landmarks",
        "station",
        to.names_exchanged("station.csv", "LM1", "LM2"),
        INTERCHANGED,
    ),
    Kind(
        "station: known points exchanged",
        "names of two known points",
        "station",
        to.names_exchanged("station.csv", "K1", "K2"),
        ("interchanged", *CONTRADICTED),
    ),
)
KINDS: tuple[Kind, ...] = (
    *_LANDMARKS,
    *_FLOORS,
    *_POSES,
    *_WIFI,
    *_SENSORS,
    *_PHONE,
    *_IMPORTS,
    *_TABLES,
    *_CORRECTIONS,
    *_MEASURED,
)
