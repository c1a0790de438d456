"""``corrections.toml``: what its owner knows better than the raw files; those stay untouched."""

from __future__ import annotations

from dataclasses import replace
from datetime import datetime
from pathlib import Path
from typing import Annotated, Literal, Self

from pydantic import BeforeValidator, Field, FiniteFloat, NaiveDatetime, model_validator

from vislam2tag.common.files.toml_file import read_toml
from vislam2tag.common.findings import FaultKind
from vislam2tag.common.records import Record
from vislam2tag.site.model import SessionKey, landmark_id

CORRECTIONS_FILE = "corrections.toml"
UNITS_M = {"ft": 0.3048, "in": 0.0254, "cm": 0.01, "mm": 0.001}
"""Metres in each unit that a table of landmarks may be in by mistake."""
_START_FORMATS = ("%Y-%m-%dT%H:%M:%S", "%Y-%m-%dT%H%M%S")


def session_start(name: str) -> datetime | None:
    """Start time that a session folder is named by (phone's wall clock); None for any other name."""
    for pattern in _START_FORMATS:
        try:
            return datetime.strptime(name, pattern)
        except ValueError:
            continue
    return None


def _id_text(value: object) -> str:
    text = landmark_id(str(value)) if isinstance(value, str | int) and not isinstance(value, bool) else ""
    if not text:
        raise ValueError("a landmark id must be a text or a whole number")
    return text


def _date_time(value: object) -> object:
    return (session_start(value) or value) if isinstance(value, str) else value


_Id = Annotated[str, BeforeValidator(_id_text)]
_DateTime = Annotated[NaiveDatetime, BeforeValidator(_date_time)]


class Correction(Record, strict=True, populate_by_name=True):
    """One correction; the selectors say for which sessions (absent: all)."""

    floor: int | None = None
    device: str | None = None
    session: str | None = None
    """Folder name, with or without its colons."""
    reason: str = ""

    def applies(self, key: SessionKey) -> bool:
        """Return whether the selectors choose this session."""
        return (
            self.floor in (None, key.floor)
            and self.device in (None, key.device)
            and (self.session is None or self.session.replace(":", "") == key.session.replace(":", ""))
        )

    def because(self) -> str:
        """The reason in brackets, to end a sentence with."""
        return f" ({self.reason})" if self.reason else ""


class ExcludeSession(Correction):
    """Exclude sessions."""

    @model_validator(mode="after")
    def _selects(self) -> Self:
        if (self.floor, self.device, self.session) == (None, None, None):
            raise ValueError("at least one of floor, device and session is required")
        return self


class _OfSpan(Correction):
    """What concerns frames from ``from_s`` (included) to ``to_s`` (excluded) after the first frame."""

    from_s: FiniteFloat = 0.0
    to_s: float = float("inf")

    @model_validator(mode="after")
    def _is_span(self) -> Self:
        if not self.from_s < self.to_s:
            raise ValueError("from_s must be less than to_s")
        return self


class ExcludeSpan(_OfSpan):
    """Exclude a time span."""


class ExcludeLandmark(Correction):
    """Use neither the surveyed position nor the sightings of a landmark."""

    id: _Id


class SwapLandmarks(Correction):
    """Two sheets are interchanged: swap their ids in the logs."""

    ids: Annotated[list[_Id], Field(min_length=2, max_length=2)]

    @model_validator(mode="after")
    def _differ(self) -> Self:
        if self.ids[0] == self.ids[1]:
            raise ValueError("ids must be two different landmarks")
        return self


class MoveLandmark(Correction):
    """A landmark has another position, always or in sessions that start within a period (its end excluded)."""

    id: _Id
    x: FiniteFloat
    y: FiniteFloat
    sigma_m: float | None = Field(default=None, gt=0, le=10)
    """Standard deviation per axis of the new position; that of the landmark file without it."""
    since: _DateTime | None = Field(default=None, alias="from")
    until: _DateTime | None = None

    def applies(self, key: SessionKey) -> bool:
        """Return whether selectors and start time choose this session; an unknown start is in no limited period."""
        if not super().applies(key):
            return False
        if self.since is None and self.until is None:
            return True
        start = session_start(key.session)
        if start is None:
            return False
        return (self.since is None or self.since <= start) and (self.until is None or start < self.until)


class MoveControlPoint(Record, strict=True):
    """A control point has another position. Its id is its row in the file, counted from 0."""

    floor: int
    id: _Id
    x: FiniteFloat
    y: FiniteFloat
    reason: str = ""


class RenameLandmark(_OfSpan):
    """A landmark's sightings within a time span belong to another sheet."""

    id: _Id
    to: _Id


class SetLandmarkFloor(_OfSpan):
    """A landmark's sightings within a time span belong to the sheet with the same id on another floor.

    With one such entry for an id, its other sightings belong to the session's own floor.
    """

    id: _Id
    to: int

    @property
    def name(self) -> str:
        """What the sheet is called in sessions that saw both."""
        return f"{self.id} (floor {self.to})"


class LandmarkUnits(Correction):
    """The coordinates of a floor's landmarks are not in metres."""

    floor: int
    unit: Literal["ft", "in", "cm", "mm"]


class TurnLandmarks(Correction):
    """The coordinates of a floor's landmarks are mirrored (x changes its sign), then turned, then shifted."""

    floor: int
    mirrored: bool = False
    turn_deg: FiniteFloat = 0.0
    """Counter-clockwise."""
    shift_m: Annotated[list[FiniteFloat], Field(min_length=2, max_length=2)] = [0.0, 0.0]


class SetFloor(ExcludeSession):
    """Sessions that were walked on a floor other than that of their folder."""

    to: int


class SetDevice(ExcludeSession):
    """Sessions that were recorded by a device other than that of their folder."""

    to: Annotated[str, Field(min_length=1, pattern="^[^/]+$")]


class ShiftClock(Correction):
    """Add an offset to all times of one table."""

    table: Literal["sensors", "wifi", "ble", "presses", "camera"]
    offset_s: Annotated[float, Field(ge=-1e9, le=1e9)]


class DropRepeatedScans(Correction):
    """Wi-Fi scans that repeat the preceding one exactly are old results, reported again: they count once."""


class SetTap(Correction):
    """A walk was at this position at this time; without x and y, the tap at this time is removed.

    With a floor in place of a session all its walks were there then, such as at the entrance where they begin.
    """

    at_s: Annotated[float, Field(ge=0, le=1e9)]
    """Seconds after the walk's first frame."""
    x: FiniteFloat | None = None
    y: FiniteFloat | None = None

    @model_validator(mode="after")
    def _is_place(self) -> Self:
        if (self.x is None) != (self.y is None):
            raise ValueError("give both x and y, or neither")
        if self.session is None and self.floor is None:
            raise ValueError("give a session, or a floor if all its walks were there then")
        return self


class IgnoreFault(Record, strict=True):
    """A fault that is known and stays as it is: it is listed with its reason, and labels do not change."""

    kind: Annotated[FaultKind, Field(strict=False)]
    floor: int | None = None
    landmarks: list[_Id] = []
    sessions: list[str] = []
    """As ``floor / device / session``."""
    reason: Annotated[str, Field(min_length=1)]


class Corrections(Record):
    """All entries of the file, in its order; none where there is no file."""

    exclude_session: tuple[ExcludeSession, ...] = ()
    exclude_span: tuple[ExcludeSpan, ...] = ()
    exclude_landmark: tuple[ExcludeLandmark, ...] = ()
    swap_landmarks: tuple[SwapLandmarks, ...] = ()
    move_landmark: tuple[MoveLandmark, ...] = ()
    shift_clock: tuple[ShiftClock, ...] = ()
    rename_landmark: tuple[RenameLandmark, ...] = ()
    set_landmark_floor: tuple[SetLandmarkFloor, ...] = ()
    landmark_units: tuple[LandmarkUnits, ...] = ()
    turn_landmarks: tuple[TurnLandmarks, ...] = ()
    set_floor: tuple[SetFloor, ...] = ()
    set_device: tuple[SetDevice, ...] = ()
    drop_repeated_scans: tuple[DropRepeatedScans, ...] = ()
    move_control_point: tuple[MoveControlPoint, ...] = ()
    set_tap: tuple[SetTap, ...] = ()
    ignore_fault: tuple[IgnoreFault, ...] = ()

    def for_session(self, key: SessionKey) -> Corrections:
        """Keep only the entries that apply to one session; those of the site are applied to it before."""
        return Corrections(**{name: tuple(e for e in getattr(self, name) if e.applies(key)) for name in OF_SESSIONS})

    def true_key(self, key: SessionKey) -> SessionKey:
        """Floor and device that a session really has, by its folder's."""
        floor = next((entry.to for entry in self.set_floor if entry.applies(key)), key.floor)
        device = next((entry.to for entry in self.set_device if entry.applies(key)), key.device)
        return replace(key, floor=floor, device=device)

    def excludes(self, key: SessionKey) -> bool:
        """Return whether a session is left out."""
        return any(entry.applies(key) for entry in self.exclude_session)


OF_SITE = ("move_control_point", "ignore_fault")
"""Tables whose entries apply to the site or to faults, not to single sessions."""
OF_SESSIONS = tuple(name for name in Corrections.model_fields if name not in OF_SITE)


def read_corrections(root: Path) -> Corrections:
    """Read the survey's corrections; raises SurveyError naming file, entry and what was expected."""
    try:
        return read_toml(root / CORRECTIONS_FILE, Corrections)
    except FileNotFoundError:
        return Corrections()
