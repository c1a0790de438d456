"""JSON messages between page and server about changes, jobs, diagnosis, comparison and layers."""

from __future__ import annotations

from typing import Annotated, Any, Literal, TypeAlias

from pydantic import Field

from vislam2tag.common.findings import Judgement, Severity
from vislam2tag.common.records import FiniteRecord
from vislam2tag.datasets.label_comparison import LabelComparison
from vislam2tag.quality.diagnosis.record import Gain, PlaceByWalks
from vislam2tag.site.corrections.conflicts import Conflict
from vislam2tag.site.corrections.edits import AddEntry, Change
from vislam2tag.studio.messages import OutputView, Point

JobKind: TypeAlias = Literal["process", "diagnose", "radio", "dataset", "page"]
MOST_CHANGES = 100
MOST_SESSIONS = 10_000


class Problem(FiniteRecord):
    """Why a request was refused."""

    code: str
    message: str
    conflicts: list[Conflict] = []
    """What someone else changed in the same place, if that is the reason."""
    corrections: CorrectionsView | None = None
    """The current content of the file, if that is the reason."""


class EnterRequest(FiniteRecord):
    """The token of the address that the terminal shows."""

    token: str


class Invitation(FiniteRecord):
    """An address for one more device, and its QR code in lines of half blocks."""

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
    """Why the entry has no effect."""


class CorrectionsView(FiniteRecord):
    """The current file; empty text and version if there is none."""

    version: str
    text: str
    entries: list[Entry]
    problem: str | None
    """Why the file cannot be used, or not be changed entry by entry."""


class CorrectionsText(FiniteRecord):
    """The complete file."""

    text: str


class PreviewRequest(FiniteRecord):
    """Changes to preview, of a text or of the current file.

    With ``base``, the text on which the page based its change, the change is applied to the current file.
    """

    base: str | None = None
    text: str | None = None
    changes: Annotated[list[Change], Field(max_length=MOST_CHANGES)]


class Preview(FiniteRecord):
    """The result of changes of the file; nothing is saved."""

    before: str
    """The file as it is."""
    text: str
    version: str
    """Of the file as it is."""
    entries: list[Entry]
    lines: str
    """The differences as a unified diff."""
    touched: list[str]
    """Sessions that would be processed again or excluded."""


class UndoRequest(FiniteRecord):
    """A saved change to undo: the complete text before and after it."""

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
    """The job: process sessions (None: all with outdated or missing labels), search for faults, create radio maps, a
    data set, or a static page.
    """

    kind: JobKind
    sessions: Annotated[list[str] | None, Field(max_length=MOST_SESSIONS)] = None
    no_ssid: bool = False
    """Remove names of networks from the data set."""
    hash_bssid: bool = False
    """Hash addresses of networks with a key that is not stored."""


class Job(FiniteRecord):
    """A job and its progress."""

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
    """Position of a landmark in the table and according to the walks."""

    floor: int
    landmark: str | None
    x: float
    y: float
    to_x: float | None
    to_y: float | None


class FaultView(FiniteRecord):
    """A fault of the survey, and its correction."""

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
    """The certain correction."""
    alternatives: list[Change]
    """Corrections to choose from if none is certain."""
    ignore: AddEntry
    """The entry that ignores it, without its reason."""
    by_walks: PlaceByWalks | None
    places: list[FaultPlace]


class DiagnosisView(FiniteRecord):
    """Faults, with the most useful corrections first; ``quick``: from the labels alone, without gains."""

    state: Literal["none", "quick", "full"]
    stale: bool
    """Labels or corrections have changed since."""
    faults: list[FaultView]
    """With ``stale`` also those of the last search; corrected ones, too. The page matches them with corrections."""
    judgement: Judgement
    """Whether faults could be found at all, because an empty list is not an answer."""


class ComparisonView(LabelComparison):
    """Comparison of two outputs."""

    a: OutputView
    b: OutputView


class Title(FiniteRecord):
    """A display name by language."""

    en: str
    de: str


class LayerInfo(FiniteRecord):
    """A further layer of the map."""

    name: str
    title: Title
    shown: bool
    """Shown by default."""


class Layers(FiniteRecord):
    """All layers."""

    layers: list[LayerInfo]


class Feature(FiniteRecord):
    """A shape of a layer, BCS metres: a point, a line, or an area (outer ring) with holes."""

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
    """The shapes of a layer on one floor."""

    features: list[Feature]
