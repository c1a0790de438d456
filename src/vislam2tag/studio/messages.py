"""JSON answers of the server about the survey and its sessions, and query parameters of addresses.

Units are metres, seconds and radians unless a name has another one. ``openapi.json`` is generated from these records,
and the types of the page from that.
"""

from __future__ import annotations

from typing import Annotated, Any, Literal, TypeAlias, TypeVar

from pydantic import Field, field_validator

from vislam2tag.common.findings import Finding, Severity
from vislam2tag.common.records import FiniteRecord
from vislam2tag.labeling.results import ContradictionMark
from vislam2tag.sessions.corrected import SAME_TAP_S
from vislam2tag.site.model import SessionKey
from vislam2tag.studio.outputs import LABELS, WINDOW_POINTS

_View = TypeVar("_View", bound=FiniteRecord)


def seen_as(kind: type[_View], source: object, /, **more: object) -> _View:
    """A record for the page with fields that it shares with another object, and further ones."""
    shared = {name: getattr(source, name) for name in kind.model_fields if name not in more and hasattr(source, name)}
    return kind.model_validate(shared | more)


Point: TypeAlias = tuple[float, float]
Box: TypeAlias = tuple[float, float, float, float]
"""Left, right, lower and upper edge."""


class Frame(FiniteRecord):
    """From a floor's BCS to the frame that all floors share: turned, then shifted."""

    rotation_rad: float
    shift_m: Point


class FloorView(FiniteRecord):
    """A floor and the address of its plan."""

    number: int
    name: str
    elevation_m: float | None
    extent_m: Box | None
    plan: str | None
    """Address of a picture that covers exactly the extent."""
    site_T_bcs: Frame


class LandmarkView(FiniteRecord):
    """A landmark in its file, and after corrections for all sessions."""

    id: str
    floor: int
    x: float | None
    y: float | None
    z: float | None
    sigma_m: float | None
    heading_rad: float | None
    surveyed: bool
    planned: bool
    """Whether its position is only planned; planned positions count as surveyed only if the settings use them."""
    source: str
    corrected: Point | None
    """None if no correction for all sessions moves it."""
    excluded: bool
    seen_in: int
    """Sessions that logged it."""


class ControlPointView(FiniteRecord):
    """A control point in its file, and after corrections."""

    id: str
    floor: int
    x: float
    y: float
    source: str
    corrected: Point | None


class StatusView(FiniteRecord):
    """The meaning of a status; ``code`` is that of the column ``status``."""

    code: int
    label: str
    name: str
    colour: str
    meaning: str
    has_position: bool


class EventKindView(FiniteRecord):
    """The meaning of a kind of event."""

    kind: str
    name: str
    colour: str
    meaning: str


class OutputView(FiniteRecord):
    """Labels of the survey: those of the studio, the earlier ones, or others for comparison."""

    name: str
    folder: str
    strategy: str
    sessions: int


class SurveyView(FiniteRecord):
    """The survey without its sessions."""

    version: str
    name: str
    root: str
    labels: str
    """Folder of the labels."""
    program_version: str
    command: str
    """Starts the studio again; empty in a copy."""
    floors: list[FloorView]
    landmarks: list[LandmarkView]
    control_points: list[ControlPointView]
    devices: list[str]
    findings: list[Finding]
    statuses: list[StatusView]
    event_kinds: list[EventKindView]
    outputs: list[OutputView]
    strategy: str
    sigma_limit_m: float | None
    """Positions with a larger sigma are uncertain; None: no limit."""


class SessionView(FiniteRecord):
    """A session in the list; its index there is the number in the column ``session``."""

    index: int
    id: str
    """For addresses; corrections do not change it."""
    slug: str
    folder: SessionKey
    key: SessionKey
    """With corrections."""
    start: str | None
    date: str | None
    format: str
    excluded: bool
    labelled: bool
    stale: bool
    """Its labels are outdated."""
    changed: bool
    """Its labels before the last job are kept."""
    error: str | None
    duration_s: float
    distance_m: float
    frames: dict[str, int]
    labelled_share: float | None
    sigma_median_m: float | None
    expected_error_m: float | None
    """Mean error of the labels according to their sigmas."""
    error_m: float | None
    """Mean error, if ground truth exists."""
    findings: dict[str, int]
    severity: Severity | None
    events: dict[str, int]
    landmarks: list[str]
    scans: int
    floors: list[int]
    bounds: dict[str, Box]
    """By floor, around the frames that have a position."""
    refused: str | None
    """Why nothing of it is placed on the plan, as a status; None if something is, or no plan is needed."""
    tap_s: float | None
    """When a tap on the plan would help most; None if none is needed."""


class SessionList(FiniteRecord):
    """All sessions, including excluded ones."""

    version: str
    sessions: list[SessionView]


class VisitView(FiniteRecord):
    """An observed landmark."""

    landmark: str
    t: float
    x: float | None
    y: float | None
    floor: int
    distance_m: float


class TapView(FiniteRecord):
    """A known position of a walk at a moment, with its corrections; ``name`` is its source."""

    at_s: float
    x: float
    y: float
    name: str


class TapsView(FiniteRecord):
    """All taps of a walk, None if it had a tracker and its floor has no plan.

    A correction applies to the tap within ``same_s`` of its moment.
    """

    taps: list[TapView] | None
    same_s: float = SAME_TAP_S


class EventView(FiniteRecord):
    """A jump of the tracker that is not motion."""

    kind: str
    t: float
    x: float | None
    y: float | None
    floor: int
    size_m: float
    turn_rad: float | None
    reason: str


class DiscardedView(FiniteRecord):
    """Frames without a position, if the raw path can be aligned with the plan."""

    floor: int
    status: str
    points: list[Point]


class CandidateView(FiniteRecord):
    """One of the paths that a walk may have taken: its probability, and its points at the times of the placing."""

    weight: float
    points: list[Point]


class PlacingView(FiniteRecord):
    """How a walk was placed on its floor's plan by its shape."""

    labelled_share: float
    reason: str
    """Why nothing of it is labelled, as a status; ``ok`` if something is."""
    t: list[float]
    """Times of the points of all candidates."""
    candidates: list[CandidateView]
    """The most probable first; empty if the whole walk is certain."""
    tap_s: float | None
    """When a tap on the plan would help most; None if none is needed."""


class FileView(FiniteRecord):
    """A raw file."""

    name: str
    role: str
    size_bytes: int


class UsedCorrection(FiniteRecord):
    """An entry of ``corrections.toml`` that affects a session, without its reason."""

    table: str
    values: dict[str, Any]


class SessionDetail(FiniteRecord):
    """Everything about one session except its frames."""

    session: SessionView
    findings: list[Finding]
    corrections: list[str]
    """Applied corrections, one sentence each."""
    used: list[UsedCorrection]
    """All entries that affect it, those of the site, too."""
    files: list[FileView]
    visits: list[VisitView]
    events: list[EventView]
    contradictions: list[ContradictionMark]
    discarded: list[DiscardedView]
    placing: PlacingView | None
    """None if it was not placed on the plan."""


class Versions(FiniteRecord):
    """Versions that show a page whether its data is outdated."""

    survey: str
    sessions: str
    corrections: str
    labels: str


class NewLabels(FiniteRecord):
    """Ids of sessions with new labels."""

    sessions: list[str]
    version: str


MOST_PIXELS = 4096
"""Longer side of a plan's picture."""
Text = Annotated[str, Field(max_length=300)]


class WindowQuery(FiniteRecord):
    """Part of a floor, metres in its BCS; ``sessions``: indices with commas, absent: all; ``points`` at most."""

    output: Text = LABELS
    floor: int
    left: float
    right: float
    low: float
    high: float
    sessions: list[int] | None = None
    points: Annotated[int, Field(ge=1000, le=WINDOW_POINTS)] = WINDOW_POINTS

    @field_validator("sessions", mode="before")
    @classmethod
    def _split(cls, value: object) -> object:
        return [part for part in value.split(",") if part] if isinstance(value, str) else value


RadioLayer: TypeAlias = Literal["strongest", "number", "mean_dbm", "deviation_db", "sigma_db", "heard"]
