"""What page and server say to each other about changes, jobs, diagnosis, comparison and layers, as JSON."""

from __future__ import annotations

from typing import Annotated, Any, Literal, TypeAlias

from pydantic import Field

from vislam2tag.common.findings import Judgement, Severity
from vislam2tag.common.records import FiniteRecord
from vislam2tag.datasets.label_comparison import LabelComparison
from vislam2tag.quality.diagnosis.record import Gain
from vislam2tag.site.corrections.conflicts import Conflict
from vislam2tag.site.corrections.edits import Change
from vislam2tag.studio.messages import OutputView, Point

JobKind: TypeAlias = Literal["process", "diagnose", "radio", "dataset", "page"]
MOST_CHANGES = 100
MOST_SESSIONS = 10_000


class Problem(FiniteRecord):
    """Why a request was refused."""

    code: str
    message: str
    conflicts: list[Conflict] = []
    """What someone else changed in the same place, if that is why."""
    corrections: CorrectionsView | None = None
    """What is in the file now, where that is why."""


class EnterRequest(FiniteRecord):
    """The token of the address that the terminal shows."""

    token: str


class Invitation(FiniteRecord):
    """An address by which one more device may enter, and its code to scan, in lines of half blocks."""

    url: str
    code: str


class Entry(FiniteRecord):
    """One entry of ``corrections.toml``."""

    table: str
    number: int
    values: dict[str, Any]
    first_line: int
    last_line: int
    findings: list[str]
    """Why it has no effect."""


class CorrectionsView(FiniteRecord):
    """The file as it is; empty text and version where there is none."""

    version: str
    text: str
    entries: list[Entry]
    problem: str | None
    """Why it cannot be used, or not be changed entry by entry."""


class CorrectionsText(FiniteRecord):
    """The whole file."""

    text: str


class PreviewRequest(FiniteRecord):
    """Changes to look at, of a text or of the file as it is.

    With ``base``, the text that the page made its change from, the change is applied to the file as it is now.
    """

    base: str | None = None
    text: str | None = None
    changes: Annotated[list[Change], Field(max_length=MOST_CHANGES)]


class Preview(FiniteRecord):
    """What changes would make of the file; nothing is saved."""

    before: str
    """The file as it is."""
    text: str
    version: str
    """Of the file as it is."""
    entries: list[Entry]
    lines: str
    """What differs, as a unified diff."""
    touched: list[str]
    """Sessions that would be mapped again, or left out."""


class UndoRequest(FiniteRecord):
    """A saved change to take back: the whole text before it and after it."""

    before: str
    after: str


class Undone(FiniteRecord):
    """The file without the change, and its text just before: these two are the change that redoes it."""

    before: str
    corrections: CorrectionsView


class CorrectionTable(FiniteRecord):
    """A kind of correction, for forms: ``values`` is the JSON schema of an entry."""

    name: str
    summary: str
    values: dict[str, Any]


class CorrectionTables(FiniteRecord):
    """All kinds."""

    tables: list[CorrectionTable]


class JobRequest(FiniteRecord):
    """What to do: map sessions (None: all whose labels are stale or missing), look for faults, make radio maps, a data
    set, or a page of files.
    """

    kind: JobKind
    sessions: Annotated[list[str] | None, Field(max_length=MOST_SESSIONS)] = None
    no_ssid: bool = False
    """Leave names of networks out of the data set."""
    hash_bssid: bool = False
    """Hash their addresses in it, with a key that nobody keeps."""


class Job(FiniteRecord):
    """A job and how far it is."""

    id: int
    kind: JobKind
    state: Literal["queued", "running", "done", "failed", "cancelled"]
    done: int
    total: int
    error: str | None
    failed: dict[str, str]
    """Sessions that could not be read or mapped."""
    seconds: float | None


class Jobs(FiniteRecord):
    """The latest jobs."""

    jobs: list[Job]


class FaultPlace(FiniteRecord):
    """Where a landmark is by the table, and where by the walks."""

    floor: int
    landmark: str | None
    x: float
    y: float
    to_x: float | None
    to_y: float | None


class FaultView(FiniteRecord):
    """Something wrong with the survey, and what corrects it."""

    id: str
    kind: str
    floor: int | None
    landmarks: list[str]
    sessions: list[str]
    summary: str
    evidence: str
    odds: float | None
    gain: Gain | None
    lines: str
    changes: list[Change]
    places: list[FaultPlace]


class DiagnosisView(FiniteRecord):
    """Faults, those whose correction brings most first; ``quick``: of the labels alone, without gains."""

    state: Literal["none", "quick", "full"]
    stale: bool
    """Labels or corrections have changed since."""
    faults: list[FaultView]
    """With ``stale`` also those of the last search that no correction answers."""
    judgement: Judgement
    """Whether faults could be found at all: an empty list is not an answer."""


class ComparisonView(LabelComparison):
    """Two outputs side by side, and which they are."""

    a: OutputView
    b: OutputView


class Title(FiniteRecord):
    """A name for people, by language."""

    en: str
    de: str


class LayerInfo(FiniteRecord):
    """A further layer of the map."""

    name: str
    title: Title
    shown: bool
    """Without being asked for."""


class Layers(FiniteRecord):
    """All layers."""

    layers: list[LayerInfo]


class Feature(FiniteRecord):
    """Something that a layer draws, BCS metres: a point, a line, or an area (outer ring) with holes."""

    id: str
    shape: Literal["point", "line", "area"]
    floor: int
    coordinates: list[Point]
    holes: list[list[Point]] = []
    label: str = ""
    text: str = ""
    severity: Severity = Severity.INFO
    colour: str | None = None
    sessions: list[str] = []
    landmarks: list[str] = []
    changes: list[Change] = []


class LayerView(FiniteRecord):
    """What a layer draws on one floor."""

    features: list[Feature]
