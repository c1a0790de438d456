"""Units of sensors in tables of other programs: stated in the columns' names, else detected by magnitude.

Every unit is checked. A person carries the device, so gravity is 1 g, and the usual values of a sensor are known.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
import polars as pl

from vislam2tag.common.findings import Finding
from vislam2tag.core.arrays import FloatArray

GRAVITY_M_S2 = 9.80665
_WINDOW = 50
"""Readings whose mean vector is close to gravity, because steps average out."""

_STATED = 3.0
"""A stated unit is accepted if usual values are beyond its range by up to this factor."""


@dataclass(frozen=True)
class SensorUnit:
    """How many of the table's unit one of these is, and the range of usual values in it (see :class:`SensorRule`)."""

    factor: float
    least: float
    greatest: float
    names: tuple[str, ...]
    """In names of columns: lower case, without blanks."""
    detected: bool = True
    """Whether the unit is recognised by magnitude alone."""

    def fits(self, usual: float, stated: str | None) -> bool:
        """Whether this unit is the stated one and possible, or no unit is stated and this is the usual value in it."""
        if stated is None:
            return self.detected and self.least <= usual <= self.greatest
        return stated in self.names and self.least <= usual * _STATED and usual <= self.greatest * _STATED


@dataclass(frozen=True)
class SensorRule:
    """Units of one sensor; the first is that of the table ``sensors``, and is used if its range fits."""

    what: str
    quantile: float
    """Of the norms of the values that is compared with the ranges."""
    steady: bool
    """Whether norms are those of the mean vectors of short stretches."""
    units: Mapping[str, SensorUnit]
    cure: str


SENSOR_UNITS: Mapping[str, SensorRule] = {
    "ACC": SensorRule(
        "accelerations",
        0.5,
        True,
        {
            "m/s2": SensorUnit(1.0, 7.8, 12.3, ("m/s2", "m/s^2", "m/s²", "ms-2", "m/s/s", "m_s2", "mps2")),
            "g": SensorUnit(GRAVITY_M_S2, 0.8, 1.25, ("g", "gs", "g's", "gn")),
            "mg": SensorUnit(GRAVITY_M_S2 / 1000, 800.0, 1250.0, ("mg", "milli-g")),
        },
        "Log accelerations with gravity",
    ),
    "GYRO": SensorRule(
        "turn rates",
        0.95,
        False,
        {
            "rad/s": SensorUnit(1.0, 0.0, 7.0, ("rad/s", "rad/sec", "rads", "rads-1", "rad_s")),
            "deg/s": SensorUnit(
                np.pi / 180, 12.0, 2000.0, ("deg/s", "deg/sec", "°/s", "dps", "degs-1", "deg_s", "degrees/s")
            ),
            "mdeg/s": SensorUnit(np.pi / 180_000, 12_000.0, 2e6, ("mdps", "mdeg/s"), detected=False),
        },
        "Walk with the device on the body",
    ),
    "MAG": SensorRule(
        "magnetic fields",
        0.5,
        False,
        {
            "uT": SensorUnit(1.0, 5.0, 250.0, ("ut", "µt", "μt", "microtesla")),
            "G": SensorUnit(100.0, 0.05, 2.5, ("g", "gs", "gauss")),
            "mG": SensorUnit(0.1, 50.0, 2500.0, ("mg", "mgauss", "milligauss"), detected=False),
            "nT": SensorUnit(0.001, 5000.0, 250_000.0, ("nt", "nanotesla")),
            "mT": SensorUnit(1000.0, 0.005, 0.25, ("mt", "millitesla"), detected=False),
        },
        "Log calibrated values",
    ),
    "PRESSURE": SensorRule(
        "pressures",
        0.5,
        False,
        {
            "hPa": SensorUnit(1.0, 500.0, 1200.0, ("hpa", "mbar", "mb", "millibar")),
            "Pa": SensorUnit(0.01, 50_000.0, 120_000.0, ("pa",)),
            "kPa": SensorUnit(10.0, 50.0, 120.0, ("kpa",)),
            "bar": SensorUnit(1000.0, 0.5, 1.2, ("bar", "atm"), detected=False),
            "mmHg": SensorUnit(1.33322, 375.0, 900.0, ("mmhg", "torr"), detected=False),
            "inHg": SensorUnit(33.8639, 14.7, 35.5, ("inhg",), detected=False),
        },
        "Log absolute pressures",
    ),
}
"""By what the table ``sensors`` calls them, in units of Android.

ACC: gravity, which the mean over a second shows at any attitude. GYRO: a person who walks turns a device at less than 7
rad/s in 95 of 100 readings, and at more than 12 deg/s in 5 of 100. MAG: the Earth's field is 22 to 67 uT, and steel
halves or doubles it. PRESSURE: from sea level to 5,500 m.
"""
_NAMES = {name for rule in SENSOR_UNITS.values() for unit in rule.units.values() for name in unit.names}
UNIT_IN_NAME = f"(?:{'|'.join(map(re.escape, sorted(_NAMES, key=len, reverse=True)))})"
"""Pattern of a unit in the name of a column, in lower case."""


def stated_unit(sensor: str, texts: Iterable[str | None]) -> str | None:
    """The first of some texts in a column's name that is a unit of a sensor; None if none is."""
    known = {name for unit in SENSOR_UNITS[sensor].units.values() for name in unit.names}
    return next((unit for text in texts if text is not None and (unit := text.replace(" ", "")) in known), None)


def in_sensor_unit(
    values: FloatArray, sensor: str, stated: str | None, file: str
) -> tuple[FloatArray | None, list[Finding]]:
    """Convert values (k, a) of a sensor to the unit of the table ``sensors``; None if their unit is unknown.

    ``stated`` is the unit in the columns' names. A stated unit is used if the values are usual in it.
    """
    factor, odd = sensor_factor(values, sensor, stated, file)
    return (None if factor is None else values * factor), odd


def sensor_factor(values: FloatArray, sensor: str, stated: str | None, file: str) -> tuple[float | None, list[Finding]]:
    """By what to multiply values, as :func:`in_sensor_unit` does."""
    rule = SENSOR_UNITS[sensor]
    usual = _usual(values, rule)
    if not np.isfinite(usual):
        return 1.0, []
    name = next((name for name, unit in rule.units.items() if unit.fits(usual, stated)), None)
    if name is None:
        return None, [_unknown(rule, usual, stated, len(values), file)]
    unit = rule.units[name]
    if unit.factor == 1.0:
        return 1.0, []
    ours, why = next(iter(rule.units)), f"95 % are below {usual:.3g}" if rule.quantile > 0.5 else f"usually {usual:.3g}"
    reason = "as the columns' names state" if stated is not None else f"by their magnitude ({why})"
    message = f"{rule.what} are in {name} {reason}; they are converted to {ours}. No action needed if that is right"
    return unit.factor, [Finding(kind="sensor_unit", file=file, count=len(values), message=message)]


_CONSTANT, _NEARLY_ALL = 0.2, 0.8
"""Mean vectors of gravity nearly all have their median length, up to this share of it; those of turn rates do not."""


def with_axes_in_place(
    rows: pl.DataFrame, rates: Sequence[str], accelerations: Sequence[str], file: str
) -> tuple[pl.DataFrame, list[Finding]]:
    """Exchange the columns of turn rates and accelerations if their contents are exchanged, and report that.

    Only turn rates that have the constant length of gravity, and accelerations that do not, show it.
    """
    values = [rows.select(axes).drop_nulls().to_numpy() for axes in (rates, accelerations)]
    if min(map(len, values)) < 2 * _WINDOW or not _is_gravity(values[0]) or _is_gravity(values[1]):
        return rows, []
    message = (
        f"column {rates[0]} and its other axes have the constant length of gravity, and {accelerations[0]} does not: "
        "the columns of gyroscope and accelerometer are exchanged; they are read the other way round. Correct the file"
    )
    taken = dict(zip((*rates, *accelerations), (*accelerations, *rates), strict=True))
    finding = Finding(kind="exchanged_columns", file=file, count=rows.height, message=message)
    return rows.with_columns(rows[old].alias(new) for new, old in taken.items()), [finding]


def _is_gravity(values: FloatArray) -> bool:
    size = _sizes(values, steady=True)
    usual = float(np.median(size)) if len(size) else np.nan
    steady = np.count_nonzero(np.abs(size - usual) <= _CONSTANT * usual) >= _NEARLY_ALL * len(size)
    return bool(steady) and any(unit.fits(usual, None) for unit in SENSOR_UNITS["ACC"].units.values())


def _usual(values: FloatArray, rule: SensorRule) -> float:
    size = _sizes(values, steady=rule.steady)
    return float(np.quantile(size, rule.quantile)) if len(size) else np.nan


def _sizes(values: FloatArray, *, steady: bool) -> FloatArray:
    """Lengths of values (k, a), or of the mean vectors of short stretches; those that are not finite are left out."""
    sound = values[np.isfinite(values).all(axis=1)]
    if steady and len(sound) >= 2 * _WINDOW:
        whole = sound[: len(sound) // _WINDOW * _WINDOW]
        sound = whole.reshape(-1, _WINDOW, values.shape[1]).mean(axis=1)
    with np.errstate(over="ignore"):
        size = np.linalg.norm(sound, axis=1)
    return np.asarray(size[np.isfinite(size)])


def _unknown(rule: SensorRule, usual: float, stated: str | None, count: int, file: str) -> Finding:
    known = ", ".join(f"{unit.least:g} to {unit.greatest:g} {name}" for name, unit in rule.units.items())
    columns = "no column's name states a unit" if stated is None else f"the columns' names state {stated}"
    message = (
        f"{rule.what} are usually {usual:.3g}, and {columns}: expected {known}; they are not used. {rule.cure}, and "
        "write the unit into the columns' names"
    )
    return Finding(kind="unknown_unit", file=file, count=count, message=message)
