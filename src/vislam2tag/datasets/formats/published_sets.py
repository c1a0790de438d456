"""Published data sets that are tables of levels; 100 means not heard, unless another level is stated.

Tampere (Lohan et al., Data 2017, 2(4), 32): files ``Training_rss_*.csv``, ``..._coordinates_*.csv``,
``..._device_*.csv`` and ``..._date_*.csv``, and the same for ``Test_``. They have no headers, and one row for each
fingerprint. The coordinates x, y, z are metres in a local frame; floors are 3.7 m apart.

UJI's long-term library set (Mendoza-Silva et al., Data 2018, 3(1), 3): one folder for each month. It contains
``trnNNrss.csv`` (levels, 100: not heard), ``...crd.csv`` (x, y in metres, floor), ``...tms.csv`` (local time as digits
from year to millisecond) and ``...ids.csv``, and the same for ``tst``, without headers. In the official split the first
month's ``trn`` is the training set, and later months are the test set. The first month's own tests show no change over
time and are in neither part.

UTSIndoorLoc (Song et al., CNNLoc, IEEE Access 2019): ``UTS_training.csv`` and ``UTS_test.csv``, one row for each
fingerprint. They have 589 columns of levels (100: not heard), then ``Pos_x``, ``Pos_y`` in metres and ``Floor_ID``, and
further columns, of which building, user and phone are used. The rows of one walk are unknown, so each file is one
session.

WiFine (Khassanov et al. 2021): trajectories of scans, one CSV file and session each, in the folders ``train``, ``val``
and ``test``. Columns of levels (-100: not heard) are named by numbers from 0, followed by ``num_visible_APs``,
``timestamp`` in seconds since the walk's start, ``x``, ``y``, ``z`` in metres and ``floorID``. In the official split
the walks of ``val`` are in neither part.

SODIndoorLoc (Bi et al., Satellite Navigation 2022, 3, 25): ``Training_BUILDING_AP_30.csv`` and
``Testing_BUILDING_AP.csv`` of the buildings HCXY and SYL, ``Training_CETC331.csv`` and ``Testing_CETC331.csv``. Columns
``MAC1`` and so on, which differ between buildings, ``ECoord`` and ``NCoord`` in local metres, ``FloorID``,
``BuildingID``, ``UserID`` and ``PhoneID``. Its other sheets (``All``, ``Avg``) are views of the same scans.

DungeonAssistant (Qin 2023): ``dataset.csv``, one walk with an AR app. The columns ``1``, ``2``, ``3`` are x, y (up) and
z in metres, ``write_time`` is local time, all others are levels (empty: not heard) by address.

TUJI1 (Torres-Sospedra et al., 2023): ``RSS_training.csv``, ``Coordinates_training.csv`` and the same of ``testing``,
without headers. The coordinates begin with x and y in metres and end with the number of the phone.

``trn-tst``, the layout of DSI, LIB, MINT, TUT, MAN, SAH, TIE and others in the comparison by Torres-Sospedra et al.
(Sensors 2020, 20(18)): ``NAME_trnrss.csv``, ``NAME_trncrd.csv`` and the same of ``tst``, without headers. The
coordinates are x, y and height in metres, floor and building.
"""

from __future__ import annotations

import re

import polars as pl

from vislam2tag.datasets.fingerprint_tables import FILE, FOLDER, WALK, FingerprintTables, RowCheck, SetDescription
from vislam2tag.datasets.model import TEST, TRAIN

STOREY_M = 3.7
_OFF_FLOOR_M = 0.05
"""A height at a larger distance from every floor is a finding; the closest floor is used."""
_STOREY = pl.col("z") / STOREY_M
_FLOOR = _STOREY.round().cast(pl.Int32, strict=False)
_TAMPERE_TIME = pl.col("date").str.to_datetime("%Y-%m-%d %H:%M:%S", time_unit="ns", strict=False)
TAMPERE = FingerprintTables(
    SetDescription(
        "tampere",
        name="tampere",
        title="Wi-Fi Crowdsourced Fingerprinting Dataset for Indoor Positioning (Tampere)",
        description="One university building, crowdsourced; times are the phones' local time.",
        licence="CC-BY-4.0",
        creators=(
            "Elena Simona Lohan",
            "Joaquín Torres-Sospedra",
            "Helena Leppäkoski",
            "Philipp Richter",
            "Zhe Peng",
            "Joaquín Huerta",
        ),
        storey_m=STOREY_M,
    ),
    files=re.compile(r"(?P<walk>Training|Test)_(?P<role>rss|coordinates|device|date)(_.*)?\.csv", re.IGNORECASE),
    none_found="contains no Training_rss_*.csv or Test_rss_*.csv; expected the four files of the Tampere data set",
    missing="has no {walk} {role}.csv; expected rss, coordinates, device, date of each part",
    companions={
        "coordinates": dict.fromkeys("xyz", pl.Float64()),
        "device": {"device": pl.String()},
        "date": {"date": pl.String()},
    },
    optional=("device", "date"),
    fields={
        **{name: pl.col(name) for name in ("x", "y", "z", "device")},
        "floor": _FLOOR,
        "time_ns": _TAMPERE_TIME.cast(pl.Int64),
        "date": _TAMPERE_TIME.cast(pl.Date),
        "part": pl.col(WALK).replace_strict({"training": TRAIN, "test": TEST}),
        "session": pl.concat_str("device", _TAMPERE_TIME.cast(pl.Date), separator=" ", ignore_nulls=True),
    },
    checks=(
        RowCheck(
            "height_off_floor",
            "coordinates",
            ((_STOREY - _FLOOR) * STOREY_M).abs() > _OFF_FLOOR_M,
            "heights are not multiples of 3.7 m; the closest floor is used",
        ),
        RowCheck(
            "unreadable_dates",
            "date",
            _TAMPERE_TIME.is_null() & pl.col("date").is_not_null(),
            "dates do not have the form 2017-08-18 11:59:23; they are skipped",
        ),
    ),
)
TAMPERE.register()


_UJI_TIME = pl.col("time").str.to_datetime("%Y%m%d%H%M%S%3f", time_unit="ns", strict=False)
UJI_LIBRARY = FingerprintTables(
    SetDescription(
        "uji-library",
        name="uji-library",
        title="Long-Term Wi-Fi fingerprinting dataset for robust indoor positioning",
        description="Two floors of a university library, walked each month with one phone.",
        licence="CC-BY-4.0",
        creators=(
            "Germán Martín Mendoza-Silva",
            "Philipp Richter",
            "Joaquín Torres-Sospedra",
            "Elena Simona Lohan",
            "Joaquín Huerta",
        ),
    ),
    files=re.compile(r"(?P<walk>(trn|tst)\d\d)(?P<role>rss|crd|tms|ids)\.csv", re.IGNORECASE),
    none_found="contains no MM/trnNNrss.csv; expected UJI's long-term library set",
    missing="month {folder} has no {walk}{role}.csv; expected rss, crd, tms",
    by_folder=True,
    companions={"crd": dict.fromkeys(("x", "y", "floor"), pl.Float64()), "tms": {"time": pl.String()}},
    fields={
        **{name: pl.col(name) for name in "xy"},
        "floor": pl.col("floor").cast(pl.Int32),
        "time_ns": _UJI_TIME.cast(pl.Int64),
        "date": _UJI_TIME.cast(pl.Date),
        "session": pl.format("month_{}.{}", FOLDER, WALK),
        "part": pl.when(pl.col(FOLDER) > pl.col(FOLDER).min())
        .then(pl.lit(TEST))
        .when(pl.col(WALK).str.starts_with("trn"))
        .then(pl.lit(TRAIN)),
    },
    checks=(
        RowCheck(
            "unreadable_dates",
            "tms",
            _UJI_TIME.is_null() & pl.col("time").is_not_null(),
            "times do not consist of the digits from year to millisecond; they are skipped",
        ),
    ),
)
UJI_LIBRARY.register()


_UTS_PLACE = ("Pos_x", "Pos_y", "Floor_ID")
UTS = FingerprintTables(
    SetDescription(
        "uts",
        name="uts",
        title="UTSIndoorLoc",
        description="One university building of several floors.",
        clock="none",
    ),
    files=re.compile(r"UTS_(training|test)\.csv", re.IGNORECASE),
    none_found="contains no UTS_training.csv or UTS_test.csv; expected UTSIndoorLoc's files",
    columns={
        **dict.fromkeys(_UTS_PLACE, pl.Float64()),
        **dict.fromkeys(("Building_ID", "User_ID", "Phone_type"), pl.String()),
    },
    access_points=re.compile(r"W?AP[_ ]?\d+", re.IGNORECASE),
    needed=_UTS_PLACE,
    gaps_allowed=True,
    fields={
        "building": pl.col("Building_ID"),
        "floor": pl.col("Floor_ID").cast(pl.Int32, strict=False),
        "x": pl.col("Pos_x"),
        "y": pl.col("Pos_y"),
        "device": pl.col("Phone_type"),
        "user": pl.col("User_ID"),
        "session": pl.col(FILE),
        "part": pl.col(WALK).replace_strict({"uts_training": TRAIN, "uts_test": TEST}),
    },
)
UTS.register()


WIFINE = FingerprintTables(
    SetDescription(
        "wifine",
        name="wifine",
        title="WiFine: finer-level sequential WiFi-based indoor localization",
        description="One university building, three floors, walked with one phone.",
        licence="MIT",
        creators=(
            "Yerbolat Khassanov",
            "Mukhamet Nurpeiissov",
            "Azamat Sarkytbayev",
            "Askat Kuzdeuov",
            "Huseyin Atakan Varol",
        ),
        clock="boot",
    ),
    files=re.compile(r"(train|val|test)_[0-9a-z_]+\.csv", re.IGNORECASE),
    recognised_by=re.compile(r"(train|val|test)/\1_[0-9a-z_]+\.csv", re.IGNORECASE),
    none_found="contains no train/train_*.csv, val/val_*.csv or test/test_*.csv of WiFine",
    columns=dict.fromkeys(("num_visible_APs", "timestamp", "x", "y", "z", "floorID"), pl.Float64()),
    access_points=re.compile(r"\d+"),
    access_point_name="ap{}",
    needed=("x", "y", "floorID"),
    not_heard=-100.0,
    lone_part=False,
    fields={
        **{name: pl.col(name) for name in "xyz"},
        "floor": pl.col("floorID").cast(pl.Int32),
        "session": pl.col(FILE),
        "time_ns": (pl.col("timestamp") * 1e9).round().cast(pl.Int64),
        "part": pl.col(WALK).str.extract(r"^(train|test)_"),
    },
)
WIFINE.register()


_SOD_BUILDINGS = {"1": "CETC331", "2": "HCXY", "3": "SYL"}
_SOD_PLACE = ("ECoord", "NCoord", "FloorID")
SODINDOORLOC = FingerprintTables(
    SetDescription(
        "sodindoorloc",
        name="sodindoorloc",
        title="SODIndoorLoc",
        description="Corridors, offices and meeting rooms of up to three buildings, surveyed at points.",
        clock="none",
    ),
    files=re.compile(r"(?P<walk>(Training|Testing)_(?P<owner>CETC331|HCXY|SYL))(_AP(_30)?)?\.csv", re.IGNORECASE),
    none_found="contains no Training_CETC331.csv, Training_HCXY_AP_30.csv or Testing_HCXY_AP.csv of SODIndoorLoc",
    columns={
        **dict.fromkeys(_SOD_PLACE, pl.Float64()),
        **dict.fromkeys(("BuildingID", "UserID", "PhoneID"), pl.String()),
    },
    access_points=re.compile(r"MAC\d+", re.IGNORECASE),
    access_points_of="owner",
    needed=_SOD_PLACE,
    fields={
        "building": pl.col("BuildingID").replace(old=_SOD_BUILDINGS),
        "floor": pl.col("FloorID").cast(pl.Int32),
        "x": pl.col("ECoord"),
        "y": pl.col("NCoord"),
        "device": pl.col("PhoneID"),
        "user": pl.col("UserID"),
        "session": pl.col(FILE),
        "part": pl.when(pl.col(WALK).str.starts_with("training")).then(pl.lit(TRAIN)).otherwise(pl.lit(TEST)),
    },
)
SODINDOORLOC.register()


_DUNGEON_TIME = pl.col("write_time").str.to_datetime("%Y-%m-%d %H:%M:%S", time_unit="ns", strict=False)
DUNGEON_ASSISTANT = FingerprintTables(
    SetDescription(
        "dungeon-assistant",
        name="dungeon-assistant",
        title="DungeonAssistant",
        description="One floor, walked with an AR app; times are the phone's local time.",
        licence="MIT",
        frame="the AR app's, metres",
    ),
    files=re.compile(r"dataset\.csv", re.IGNORECASE),
    recognised_by=re.compile(r"dungeon.*/dataset\.csv", re.IGNORECASE),
    none_found="contains no dataset.csv of DungeonAssistant",
    columns={**dict.fromkeys("123", pl.Float64()), "write_time": pl.String()},
    access_points=re.compile(r"(?!)"),
    needed=("1", "2", "3"),
    by_header=True,
    fields={
        "x": pl.col("1"),
        "y": -pl.col("3"),
        "z": pl.col("2"),
        "floor": pl.lit(0, pl.Int32),
        "session": pl.col(FILE),
        "time_ns": _DUNGEON_TIME.cast(pl.Int64),
        "date": _DUNGEON_TIME.cast(pl.Date),
    },
)
DUNGEON_ASSISTANT.register()


_TUJI_PHONES = {"1": "S20", "2": "S7", "3": "POCO", "4": "tabS7", "5": "A12"}
TUJI1 = FingerprintTables(
    SetDescription(
        "tuji1",
        name="tuji1",
        title="TUJI1",
        description="One floor of an office, surveyed at points with five phones.",
        clock="none",
    ),
    files=re.compile(r"(?P<role>RSS|Coordinates)_(?P<walk>training|testing)\.csv", re.IGNORECASE),
    none_found="contains no RSS_training.csv or RSS_testing.csv of TUJI1",
    missing="has no {role}_{walk}.csv; expected RSS and Coordinates of each part",
    companions={"coordinates": dict.fromkeys(("x", "y", "z", "floor", "building", "phone"), pl.Float64())},
    fields={
        **{name: pl.col(name) for name in "xy"},
        "floor": pl.col("floor").cast(pl.Int32),
        "device": pl.col("phone").cast(pl.Int32).cast(pl.String).replace(old=_TUJI_PHONES),
        "session": pl.col(FILE),
        "part": pl.col(WALK).replace_strict({"training": TRAIN, "testing": TEST}),
    },
)
TUJI1.register()


TRN_TST = FingerprintTables(
    SetDescription("trn-tst", clock="none", frame="that of the data set, metres"),
    files=re.compile(r"(?P<walk>(?P<owner>[A-Za-z]+\d*)_(trn|tst))(?P<role>rss|crd)\.csv", re.IGNORECASE),
    none_found="contains no NAME_trnrss.csv and NAME_trncrd.csv, such as DSI1_trnrss.csv",
    missing="has no {walk}{role}.csv; expected rss and crd of each part",
    companions={"crd": dict.fromkeys(("x", "y", "height", "floor", "building"), pl.Float64())},
    access_points_of="owner",
    fields={
        **{name: pl.col(name) for name in "xy"},
        "floor": pl.col("floor").cast(pl.Int32),
        "building": pl.concat_str(
            pl.col(WALK).str.replace("_t..$", "").str.to_uppercase(), pl.col("building").cast(pl.Int32), separator=" "
        ),
        "session": pl.col(FILE),
        "part": pl.when(pl.col(WALK).str.ends_with("trn")).then(pl.lit(TRAIN)).otherwise(pl.lit(TEST)),
    },
)
TRN_TST.register()
