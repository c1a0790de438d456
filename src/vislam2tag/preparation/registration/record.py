"""Settings of a registration, and the record that it writes."""

from __future__ import annotations

from enum import StrEnum
from typing import ClassVar

from pydantic import Field

from vislam2tag.common.findings import Finding, FindingKind
from vislam2tag.common.records import Record, SettingsRecord
from vislam2tag.common.tabular import Result


class RegistrationSettings(SettingsRecord):
    """Standard deviations before the adjustment; each is per axis, metres, unless said otherwise."""

    removed = frozenset(("click_px", "false_alarm", "least_sigma_m", "prior_freedom"))
    shot_sigma_m: float = Field(default=0.003, gt=0)
    """Standard deviation of a total-station shot per axis, metres, with pointing."""
    height_sigma_m: float = Field(default=0.005, gt=0)
    """Standard deviation of the height of a shot, metres."""
    control_sigma_m: float = Field(default=0.005, gt=0)
    """Standard deviation of a known point whose file gives none, metres."""
    tape_sigma_m: float = Field(default=0.02, gt=0)
    """Standard deviation of a tape distance, metres, with slope and sag."""
    target_sigma_m: float = Field(default=0.03, gt=0)
    """Standard deviation of a wall or corner for tape distances whose file gives none, metres."""
    plan_sigma_m: float = Field(default=0.1, gt=0)
    """Standard deviation of a point on the plan, metres."""


INTERCHANGED: FindingKind = "interchanged_landmarks"
"""Kind of the finding that two landmarks lie in each other's place."""
OTHER_NAMES: tuple[FindingKind, ...] = ("other_ids", "shifted_ids")
"""Kinds of findings about ids that are wrong."""


class PositionSource(StrEnum):
    """How a position was found, the best first."""

    STATION = "station"
    TAPE = "tape"
    CLICK = "click"


class RegisteredPoint(Record):
    """A landmark or control point of the floor, BCS metres; None where something is not known."""

    point: str
    x_m: float
    y_m: float
    z_m: float | None = None
    """Above the floor."""
    sigma_m: float
    """Standard deviation per axis, sqrt(trace / 2)."""
    covariance_m2: tuple[tuple[float, float], tuple[float, float]]
    z_sigma_m: float | None = None
    heading_rad: float | None = None
    heading_sigma_rad: float | None = None
    source: PositionSource
    measurements: int
    checked: float
    """How much of its measurements others check: 0 nothing would show an error, 1 everything."""
    note: str = ""


class Residual(Record):
    """What one measurement is off by: measured minus adjusted, metres."""

    measurement: str
    at_m: tuple[float, float] | None = None
    """Where the point is, BCS; None for a distance."""
    by_m: tuple[float, float] | None = None
    """Along the BCS axes; None for a distance."""
    off_m: float
    sigmas: float
    """In standard deviations of the residual; 0 where nothing checks the measurement."""
    checked: float


class StationRow(Record):
    """One station: where its frame's origin is, BCS metres, and how it is turned."""

    station: str
    x_m: float
    y_m: float
    turn_rad: float
    shots: int


class Repeat(Record):
    """A point shot more than once from one station: the spread of the shots about their mean."""

    point: str
    station: str
    shots: int
    spread_m: float
    """Root of the mean squared distance from the mean, per axis."""


class ScaleTest(Record):
    """Distances in the building over those of the stations, were the scale free."""

    value: float
    sigma: float
    off: bool
    """Whether it differs from 1 for certain."""


class Registration(Result):
    """Everything that was found of one floor."""

    main_table: ClassVar[str] = "landmarks"

    version: str
    floor: int
    landmarks: tuple[RegisteredPoint, ...] = ()
    control_points: tuple[RegisteredPoint, ...] = ()
    stations: tuple[StationRow, ...] = ()
    sigma0: float | None = None
    redundancy: int = 0
    plausible: bool = True
    scale: ScaleTest | None = None
    residuals: tuple[Residual, ...] = ()
    tape_residuals: tuple[Residual, ...] = ()
    repeats: tuple[Repeat, ...] = ()
    errors: tuple[str, ...] = ()
    """What looked wrong and was left out, a sentence each."""
    unplaced: dict[str, str] = {}
    """Landmarks without a position, and why."""
    findings: tuple[Finding, ...] = ()

    @property
    def has_other_names(self) -> bool:
        """Whether the names are not those of the landmark table: then the positions belong to no row of it."""
        return any(finding.kind in OTHER_NAMES for finding in self.findings)

    @property
    def has_points(self) -> bool:
        """Whether any landmark or control point has a position."""
        return bool(self.landmarks or self.control_points)

    @property
    def complete(self) -> bool:
        """Whether nothing was left out, every landmark has a position, and all ids seem to be right."""
        interchanged = any(finding.kind == INTERCHANGED for finding in self.findings)
        return not self.errors and not self.unplaced and not interchanged and not self.has_other_names
