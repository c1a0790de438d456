"""Functions that change the meaning of a clean input and keep its form; ``mutation_kinds.py`` names the changes."""

from __future__ import annotations

import shutil
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from datetime import datetime, timedelta
from functools import partial
from pathlib import Path
from typing import TypeAlias

import numpy as np
from mutation_inputs import walks
from mutation_tables import Rows


@dataclass(frozen=True)
class Case:
    """A copy of a clean input, and random numbers."""

    folder: Path
    rng: np.random.Generator

    @property
    def walks(self) -> list[Path]:
        """Folders of all walks."""
        return walks(self.folder)

    def walk(self) -> Path:
        """The folder of any walk."""
        return self.walks[self.rng.integers(len(self.walks))]

    def marks(self) -> list[Rows]:
        """Landmark tables of all floors."""
        return [Rows.read(path) for path in sorted(self.folder.glob("survey/floor_*/marker_dict.csv"))]

    def dimensions(self) -> Rows:
        """Sizes of the floors."""
        return Rows.read(self.folder / "survey" / "floor_dimensions.csv")

    def passed(self) -> list[str]:
        """Ids of landmarks by how many walks of the first floor pass them, the most frequent first."""
        seen: dict[str, int] = {}
        for walk in self.walks:
            for name in {row[0] for row in _log(walk).rows}:
                seen[name] = seen.get(name, 0) + 1
        return sorted(seen, key=lambda name: -seen[name])


Change: TypeAlias = Callable[[Case], None]
NewCells: TypeAlias = Callable[[list[str]], Sequence[str]]
FT_M, G_M_S2 = 0.3048, 9.80665


def floats(new: Callable[..., Sequence[float]], digits: int = 6) -> Callable[[list[str]], list[str]]:
    """Change cells as numbers."""
    return lambda cells: [f"{value:.{digits}f}" for value in new(*map(float, cells))]


def scaled(factor: float, digits: int = 6) -> Callable[[list[str]], list[str]]:
    """Multiply cells."""
    return floats(lambda *values: [value * factor for value in values], digits)


def exchanged(cells: list[str]) -> list[str]:
    """Exchange two cells."""
    return cells[::-1]


def whole(new: Callable[[int], int]) -> Callable[[list[str]], list[str]]:
    """Change cells as whole numbers."""
    return lambda cells: [str(new(int(cell))) for cell in cells]


def spreadsheet(cells: list[str]) -> list[str]:
    """Write cells with five decimals and an exponent."""
    return [f"{float(cell):.5E}" for cell in cells]


def landmarks(new: NewCells, columns: Sequence[str] = ("x", "y")) -> Change:
    """Change cells of all landmark tables."""

    def change(case: Case) -> None:
        for rows in case.marks():
            rows.change(columns, new)

    return change


def sized(new: Callable[[float, float, float], Sequence[float]]) -> Change:
    """Change landmarks by x, y, and the height of their floor."""

    def change(case: Case) -> None:
        heights = {row[0]: float(row[2]) for row in case.dimensions().rows}
        for rows in case.marks():
            height = heights[rows.path.parent.name.removeprefix("floor_")]
            rows.change(("x", "y"), floats(lambda x, y, height=height: new(x, y, height)))

    return change


def _file(walk: Path, *names: str) -> Path:
    return next(each for each in walk.iterdir() if each.name in names)


def _poses(walk: Path) -> Rows:
    return Rows.read(_file(walk, "poses.csv", "CameraPose.csv"))


def _log(walk: Path) -> Rows:
    return Rows.read(_file(walk, "initPoses.csv", "LandmarkPose.csv"))


def _wifi(walk: Path) -> Rows:
    return Rows.read(_file(walk, "wifi.csv", "WiFi.csv"))


def _sensors(walk: Path) -> Rows:
    return Rows.read(_file(walk, "sensors.csv", "Sensors.csv"))


def ids_exchanged(case: Case) -> None:
    """Exchange the ids of two landmarks."""
    rows, (one, other) = case.marks()[0], case.passed()[:2]
    rows.change(("id",), lambda cells: [{one: other, other: one}.get(cells[0], cells[0])])


def one_moved(case: Case) -> None:
    """Move a landmark by 3 m."""
    rows, name, turn = case.marks()[0], case.passed()[0], case.rng.uniform(0, 2 * np.pi)
    new = floats(lambda x, y: (x + 3 * np.cos(turn), y + 3 * np.sin(turn)))
    rows.change(("x", "y"), new, lambda row: row[0] == name)


def id_twice(case: Case) -> None:
    """Add a second row of an id, 6 m away."""
    rows, name = case.marks()[0], case.passed()[0]
    row = next(row for row in rows.rows if row[0] == name)
    rows.rows.insert(0, [row[0], f"{float(row[1]) + 6:.4f}", *row[2:]])
    rows.write()


def degrees(x: float, y: float) -> tuple[float, float]:
    """Longitude and latitude of metres."""
    return 6.08 + x / 71_700, 50.78 + y / 111_200


def turned_frame(x: float, y: float) -> tuple[float, float]:
    """Turn a place by 3 degrees, and shift it."""
    turned = complex(x, y) * np.exp(0.05j)
    return turned.real + 1.0, turned.imag


def quoted_landmarks(case: Case) -> None:
    """Write coordinates in quotes, with decimal commas."""
    for rows in case.marks():
        rows.change(("x", "y"), lambda cells: [f'"{cell.replace(".", ",")}"' for cell in cells])


def landmarks_with_semicolons(case: Case) -> None:
    """Write landmark tables with semicolons and decimal commas."""
    for rows in case.marks():
        rows.separator, rows.decimal = ";", ","
        rows.write()


def floors_exchanged(case: Case) -> None:
    """Exchange the landmark tables of two floors."""
    first, second = (rows.path for rows in case.marks()[:2])
    _exchange(first, second)


def _exchange(first: Path, second: Path) -> None:
    aside = first.with_name("aside")
    first.rename(aside)
    second.rename(first)
    aside.rename(second)


def floors(new: NewCells) -> Change:
    """Change width and height of floors."""
    return lambda case: case.dimensions().change((1, 2), new)


Columns: TypeAlias = Sequence[str | int]
POSITION = ((1, 2, 3), (2, 3, 4))
"""Columns of the camera's poses and of the landmarks'."""
QUATERNION = ((4, 5, 6, 7), (5, 6, 7, 8))
WHOLE_POSE = tuple((*position, *turn) for position, turn in zip(POSITION, QUATERNION, strict=True))
PHONE_POSITION = (("tx_m", "ty_m", "tz_m"),) * 2
PHONE_QUATERNION = (("qx", "qy", "qz", "qw"),) * 2


def walked(new: NewCells, columns: Sequence[Columns] = POSITION) -> Change:
    """Change cells of the poses of camera and landmarks of a walk."""

    def change(case: Case) -> None:
        walk = case.walk()
        for rows, names in zip((_poses(walk), _log(walk)), columns, strict=True):
            rows.change(names, new)

    return change


def _product(a: Sequence[float], b: Sequence[float]) -> list[float]:
    """Product of quaternions x, y, z, w."""
    (ax, ay, az, aw), (bx, by, bz, bw) = a, b
    return [
        aw * bx + ax * bw + ay * bz - az * by,
        aw * by - ax * bz + ay * bw + az * bx,
        aw * bz + ax * by - ay * bx + az * bw,
        aw * bw - ax * bx - ay * by - az * bz,
    ]


def _in_frame(turn: Sequence[float]) -> Callable[[list[str]], list[str]]:
    """Poses in a world frame that is turned by a quaternion."""
    back = [-turn[0], -turn[1], -turn[2], turn[3]]

    def new(*values: float) -> list[float]:
        place = _product(_product(turn, [*values[:3], 0.0]), back)[:3]
        return [*place, *_product(turn, values[3:])]

    return floats(new)


Z_UP = _in_frame((np.sqrt(0.5), 0.0, 0.0, np.sqrt(0.5)))
YAW = _in_frame((0.0, np.sin(0.4), 0.0, np.cos(0.4)))


def inverted(*values: float) -> list[float]:
    """Invert a pose."""
    back = [-values[3], -values[4], -values[5], values[6]]
    place = _product(_product(back, [-values[0], -values[1], -values[2], 0.0]), list(values[3:]))[:3]
    return [*place, *back]


def left_handed(x: float, y: float, z: float, a: float, b: float, c: float, w: float) -> list[float]:
    """Mirror a pose."""
    return [-x, y, z, a, -b, -c, w]


def times(new: Callable[[list[str]], list[str]], *tables: str) -> Change:
    """Change the times of some tables of a walk: ``poses``, ``log``, ``wifi``, ``sensors``."""

    def change(case: Case) -> None:
        walk = case.walk()
        for name in tables:
            _timed(name, walk, new)

    return change


def _timed(name: str, walk: Path, new: NewCells) -> None:
    rows = _READ[name](walk)
    rows.change(("time_ns",) if rows.head else (1 if name in {"log", "wifi"} else 0,), new)


_READ = {"poses": _poses, "log": _log, "wifi": _wifi, "sensors": _sensors}


def in_seconds(cells: list[str]) -> list[str]:
    """Write times in seconds, with fractions."""
    return [f"{int(cells[0]) / 1e9:.6f}"]


def all_shifted(case: Case) -> None:
    """Shift the times of all tables by 37 s."""
    later, later_us = whole(lambda time: time + 37_000_000_000), whole(lambda time: time + 37_000_000)
    for walk in case.walks:
        for name in _READ:
            _timed(name, walk, later_us if name == "wifi" else later)


def frames_twice(case: Case) -> None:
    """Write every row of poses and landmarks twice."""
    walk = case.walk()
    for rows in (_poses(walk), _log(walk)):
        rows.rows = [row for row in rows.rows for _ in (1, 2)]
        rows.write()


def other_floor(case: Case) -> None:
    """Move a walk to another floor."""
    walk = case.walk()
    floor = case.folder / "survey" / f"floor_{1 - int(walk.parts[-3].removeprefix('floor_'))}"
    shutil.move(walk, floor / walk.parent.name / walk.name)


def other_device(case: Case) -> None:
    """Move a walk to another device."""
    walk = case.walk()
    others = [path for path in walk.parents[1].iterdir() if path.is_dir() and path.name != walk.parent.name]
    shutil.move(walk, others[0] / walk.name)


def copied(case: Case) -> None:
    """Copy a walk under another date."""
    walk = case.walk()
    shutil.copytree(walk, walk.with_name(walk.name.replace("202", "203", 1)))


def of_other_walk(*names: str) -> Change:
    """Exchange a file of two walks."""

    def change(case: Case) -> None:
        first, second = case.walks[:2]
        _exchange(_file(first, *names), _file(second, *names))

    return change


def levels(new: Callable[[float], float | str], digits: int = 0) -> Change:
    """Change the levels of all walks."""

    def text(cells: list[str]) -> list[str]:
        value = new(float(cells[0]))
        return [value if isinstance(value, str) else f"{value:.{digits}f}"]

    def change(case: Case) -> None:
        for walk in case.walks:
            rows = _wifi(walk)
            rows.change(("rssi_dbm",) if rows.head else (5,), text)

    return change


MASKED = "02:00:00:00:00:00"


def half_masked(cells: list[str]) -> list[str]:
    """Mask addresses whose last digit is odd."""
    return [MASKED] if int(cells[0][-1], 16) % 2 else cells


def dashed(cells: list[str]) -> list[str]:
    """Write an address as Windows does."""
    return [cells[0].replace(":", "-").upper()]


def percent(level: float) -> float:
    """Percent of a level."""
    return min(max(2 * (level + 100), 0), 100)


def addresses(new: NewCells, columns: Sequence[int] = (4,)) -> Change:
    """Change cells of Wi-Fi logs."""

    def change(case: Case) -> None:
        for walk in case.walks:
            _wifi(walk).change(columns, new)

    return change


def filled(level: str) -> Change:
    """Write access points that were not heard with a filler, as tables do."""

    def change(case: Case) -> None:
        for walk in case.walks:
            rows = _wifi(walk)
            names = sorted({row[4] for row in rows.rows})
            first: dict[str, list[str]] = {}
            heard: dict[str, set[str]] = {}
            for row in rows.rows:
                first.setdefault(row[0], row)
                heard.setdefault(row[0], set()).add(row[4])
            for scan, row in first.items():
                rows.rows += [[*row[:4], name, level] for name in names if name not in heard[scan]]
            rows.write()

    return change


def stale(case: Case) -> None:
    """Let every second scan repeat addresses and levels of the one before, at times of its own."""
    for walk in case.walks:
        rows = _wifi(walk)
        scans: list[list[list[str]]] = []
        for row in rows.rows:
            if not scans or row[0] != scans[-1][-1][0] or abs(int(row[1]) - int(scans[-1][-1][1])) > 2_500_000:
                scans.append([])
            scans[-1].append(row)
        starts = [min(int(row[1]) for row in scan) for scan in scans]
        for n in range(1, len(scans), 2):
            later = starts[n] - starts[n - 1]
            scans[n] = [[scans[n][0][0], str(int(row[1]) + later), *row[2:]] for row in scans[n - 1]]
        rows.rows = [row for scan in scans for row in scan]
        rows.write()


def sensed(kind: str, new: NewCells, everywhere: bool = True) -> Change:
    """Change the values of one or all sensors."""

    def change(case: Case) -> None:
        for walk in case.walks if everywhere else [case.walk()]:
            rows = _sensors(walk)
            columns = ("v1", "v2", "v3") if rows.head else (2, 3, 4)
            rows.change(columns, new, lambda row: row[1].startswith(kind))

    return change


def turned_axes(cells: list[str]) -> list[str]:
    """Exchange the first two of three axes."""
    x, y, z = cells
    return [y, x, z]


UJI = "table/trainingData.csv"
UJI_PLACE = ("LONGITUDE", "LATITUDE")


def table(file: str, new: NewCells, *columns: str | int) -> Change:
    """Change cells of a table."""
    return lambda case: Rows.read(case.folder / file).change(columns, new)


uji = partial(table, UJI)


def logged(file: str, new: NewCells, *columns: str | int) -> Change:
    """Change cells of a log of every walk."""

    def change(case: Case) -> None:
        for walk in case.walks:
            Rows.read(walk / file).change(columns, new)

    return change


def uji_levels(new: Callable[[float], float], filler: str = "100", digits: int = 0) -> Change:
    """Change levels and the filler."""

    def change(case: Case) -> None:
        rows = Rows.read(case.folder / UJI)
        columns = [name for name in rows.head if name.startswith("WAP")]
        rows.change(
            columns,
            lambda cells: [filler if float(cell) == 100 else f"{new(float(cell)):.{digits}f}" for cell in cells],
        )

    return change


def comford(file: str, new: NewCells, *columns: str) -> Change:
    """Change cells of a table of COMFORD."""

    def change(case: Case) -> None:
        Rows.read(next((case.folder / "table").rglob(file))).change(columns, new)

    return change


def blanks(file: str) -> Change:
    """Write blanks behind commas."""

    def change(case: Case) -> None:
        rows = Rows.read(case.folder / file)
        rows.separator = ", "
        rows.write()

    return change


def renamed(file: str, names: Sequence[str]) -> Change:
    """Write other names of columns."""

    def change(case: Case) -> None:
        rows = Rows.read(case.folder / file)
        rows.head = list(names)
        rows.write()

    return change


def every(*changes: Change) -> Change:
    """Apply several changes."""

    def change(case: Case) -> None:
        for each in changes:
            each(case)

    return change


def missing_cells(file: str, text: str, columns: Sequence[str], every: int) -> Change:
    """Write a text for every so-many-th value."""

    def change(case: Case) -> None:
        rows = Rows.read(case.folder / file)
        at = rows.at(columns)
        for row in rows.rows[::every]:
            for column in at:
                row[column] = text
        rows.write()

    return change


def dates(new: Callable[[datetime], datetime]) -> NewCells:
    """Change dates."""
    return lambda cells: [new(datetime.fromisoformat(cell)).isoformat() for cell in cells]


def set_back(case: Case) -> None:
    """Set the clock of dates back by an hour in the middle."""
    rows = Rows.read(case.folder / "table.csv")
    middle = rows.rows[len(rows.rows) // 2][0]
    rows.change((0,), dates(lambda date: date - timedelta(hours=1)), lambda row: row[0] >= middle)


def foreign(case: Case) -> None:
    """Put the recording of another walk in the place of the attached one."""
    (case.folder / "foreign.csv").replace(case.folder / "other.csv")


def corrected(text: str) -> Change:
    """Write corrections; ``{id}`` is a landmark, ``{session}`` a walk."""

    def change(case: Case) -> None:
        words = text.replace("{id}", case.passed()[0]).replace("{session}", case.walk().name)
        (case.folder / "survey" / "corrections.toml").write_text(words, encoding="utf-8")

    return change


def decimal_commas(file: str) -> Change:
    """Write a table with semicolons and decimal commas."""

    def change(case: Case) -> None:
        rows = Rows.read(case.folder / file)
        rows.separator, rows.decimal = ";", ","
        rows.write()

    return change


def quoted(file: str, *columns: str) -> Change:
    """Write cells in quotes, with decimal commas."""
    return table(file, lambda cells: [f'"{cell.replace(".", ",")}"' for cell in cells], *columns)


def unquoted(file: str) -> Change:
    """Write decimal commas between the commas of a table."""

    def change(case: Case) -> None:
        rows = Rows.read(case.folder / file)
        rows.decimal = ","
        rows.write()

    return change


def names_exchanged(file: str, one: str, other: str) -> Change:
    """Exchange two names in the first column."""
    return table(file, lambda cells: [{one: other, other: one}.get(cells[0], cells[0])], 0)
