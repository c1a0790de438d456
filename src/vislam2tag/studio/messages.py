"""What the server answers about the survey and its sessions, as JSON, and what stands behind the question mark of its
addresses; metres, seconds and radians unless a name says else.

``openapi.json`` is made of these records, and the page's types of that.
"""

from __future__ import annotations

from typing import Annotated, Literal, TypeAlias, TypeVar

from pydantic import Field, field_validator

from vislam2tag.common.findings import Finding, Severity
from vislam2tag.common.records import FiniteRecord
from vislam2tag.labeling.results import ContradictionMark
from vislam2tag.sessions.corrected import SAME_TAP_S
from vislam2tag.site.model import SessionKey
from vislam2tag.studio.outputs import LABELS, WINDOW_POINTS

_View = TypeVar("_View", bound=FiniteRecord)


def seen_as(kind: type[_View], source: object, /, **more: object) -> _View:
    """A record for the page with the fields that it shares with a value, and further ones."""
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
    """A floor and where its plan is."""

    number: int
    name: str
    elevation_m: float | None
    extent_m: Box | None
    plan: str | None
    """Address of a picture that covers exactly the extent."""
    site_T_bcs: Frame


class LandmarkView(FiniteRecord):
    """A landmark as its file has it, and as corrections for all sessions have it."""

    id: str
    floor: int
    x: float | None
    y: float | None
    z: float | None
    sigma_m: float | None
    heading_rad: float | None
    surveyed: bool
    planned: bool
    """Whether its position was only planned; it is surveyed only if the settings say that planned ones are used."""
    source: str
    corrected: Point | None
    """None where corrections leave it where it is, or concern some sessions only."""
    excluded: bool
    seen_in: int
    """Sessions that logged it."""


class ControlPointView(FiniteRecord):
    """A control point as its file has it, and as corrections have it."""

    id: str
    floor: int
    x: float
    y: float
    source: str
    corrected: Point | None


class StatusView(FiniteRecord):
    """What a status means; ``code`` is that of the column ``status``."""

    code: int
    label: str
    name: str
    colour: str
    meaning: str
    has_position: bool


class EventKindView(FiniteRecord):
    """What a kind of event means."""

    kind: str
    name: str
    colour: str
    meaning: str


class OutputView(FiniteRecord):
    """Labels of the survey: those that the studio makes, those as they were before, or others to compare with."""

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
    """Folder that labels are made in."""
    program_version: str
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
    """Positions that are less sure are uncertain; None: there is no limit."""


class SessionView(FiniteRecord):
    """A session in the list; its place there is the number in the column ``session``."""

    index: int
    id: str
    """For addresses; stays whatever is corrected."""
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
    """Its labels are not those that follow from the corrections now."""
    changed: bool
    """Its labels as they were before the last job are kept."""
    error: str | None
    duration_s: float
    distance_m: float
    frames: dict[str, int]
    labelled_share: float | None
    sigma_median_m: float | None
    error_m: float | None
    """Mean error, where the truth is known."""
    findings: dict[str, int]
    severity: Severity | None
    events: dict[str, int]
    landmarks: list[str]
    scans: int
    floors: list[int]
    bounds: dict[str, Box]
    """By floor, around the frames that have a position."""


class SessionList(FiniteRecord):
    """All sessions, those that are left out among them."""

    version: str
    sessions: list[SessionView]


class VisitView(FiniteRecord):
    """A landmark passed."""

    landmark: str
    t: float
    x: float | None
    y: float | None
    floor: int
    distance_m: float


class TapView(FiniteRecord):
    """Where a walk without tracker was at a moment, with its corrections; ``name`` tells where that is from."""

    at_s: float
    x: float
    y: float
    name: str


class TapsView(FiniteRecord):
    """All of a walk, None where it had a tracker; a correction means the tap within ``same_s`` of its moment."""

    taps: list[TapView] | None
    same_s: float = SAME_TAP_S


class EventView(FiniteRecord):
    """A step of the tracker that is no motion."""

    kind: str
    t: float
    x: float | None
    y: float | None
    floor: int
    size_m: float
    turn_rad: float | None
    reason: str


class DiscardedView(FiniteRecord):
    """Frames without a position, where the raw path can be laid over the plan."""

    floor: int
    status: str
    points: list[Point]


class FileView(FiniteRecord):
    """A raw file."""

    name: str
    role: str
    size_bytes: int


class SessionDetail(FiniteRecord):
    """Everything of one session but its frames."""

    session: SessionView
    findings: list[Finding]
    corrections: list[str]
    """Each use, a sentence."""
    files: list[FileView]
    visits: list[VisitView]
    events: list[EventView]
    contradictions: list[ContradictionMark]
    discarded: list[DiscardedView]


class Versions(FiniteRecord):
    """What tells a page that it shows something old."""

    survey: str
    sessions: str
    corrections: str
    labels: str


class NewLabels(FiniteRecord):
    """Sessions whose labels are new, by their ids."""

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
