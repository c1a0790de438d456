"""What goes over HTTP: scans in, positions out; limits are part of the messages, so that OpenAPI tells them."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field, field_validator

from vislam2tag.common.records import FiniteRecord
from vislam2tag.intake.addresses import is_masked
from vislam2tag.intake.signal_strength import SIGNAL_STRENGTH

MOST_SCANS = 500
MOST_READINGS = 1000
"""Of a scan."""
_LONGEST_NAME = 200

Level = Annotated[float, Field(ge=SIGNAL_STRENGTH.least, le=SIGNAL_STRENGTH.greatest)]
Name = Annotated[str, Field(min_length=1, max_length=_LONGEST_NAME)]


class _Message(FiniteRecord, use_attribute_docstrings=True):
    """A record whose fields OpenAPI describes by their docstrings."""


class Scan(_Message):
    """What a phone heard at one place."""

    scan_id: Name
    """Comes back with the position."""
    readings: Annotated[dict[Name, Level], Field(max_length=MOST_READINGS)]
    """Level in dBm of each access point, by its address."""
    session: Annotated[str, Field(max_length=_LONGEST_NAME)] = ""
    """Walk; scans of one that are asked for at once tell together how large their circles are. Empty: none."""

    @field_validator("readings")
    @classmethod
    def _has_addresses(cls, readings: dict[str, float]) -> dict[str, float]:
        if masked := sorted(name for name in readings if is_masked(name)):
            raise ValueError(f"{masked[0]} is no address; Android gives it to apps without the location permission")
        return readings


class LocateRequest(_Message):
    """Scans to locate."""

    scans: Annotated[list[Scan], Field(min_length=1, max_length=MOST_SCANS)]


class Position(_Message):
    """Where a scan was taken, as `vislam2tag locate` writes it; all but id and status are null where it is unknown."""

    scan_id: str
    status: Literal["ok", "unlike", "unknown"]
    """``unlike``: nothing like the scan was learned, so that no radius can be relied on."""
    building: str | None
    floor: int | None
    x: float | None
    """Metres in the frame of the floor (BCS), as y."""
    y: float | None
    z: float | None
    """Metres above the building's zero; null where the data set knows no heights."""
    radius_68_m: float | None
    """The true place lies within so many metres in the plane with 68 % probability."""
    radius_95_m: float | None
    floor_probability: float | None
    """What the model gives this floor."""


class LocateAnswer(_Message):
    """Positions in the order of the scans."""

    positions: list[Position]


class ServedFloor(_Message):
    """A floor that the model knows; the plan's extent in metres where a plan is served."""

    building: str
    floor: int
    plan: str | None
    """Address of the picture."""
    width_m: float | None = None
    height_m: float | None = None
    lower_left_m: tuple[float, float] = (0.0, 0.0)


class ServedModel(_Message):
    """What answers."""

    model: str
    dataset: str
    frame: str
    scans: int
    """How many it learned from."""
    access_points: int
    hashed_with: str | None
    """Name of the key that addresses must be hashed with; null: they are plain."""
    floors: list[ServedFloor]


class Refusal(_Message):
    """Why a request was not answered."""

    message: str
