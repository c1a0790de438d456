"""The result of one session as JSON: what summary, report and evaluation read.

It is written last (``sessions/SLUG.json``) and so marks the session as done.
"""

from __future__ import annotations

from vislam2tag.common.findings import NOT_RUN, Finding, Judgement, counted
from vislam2tag.common.records import Record
from vislam2tag.common.tabular import Result
from vislam2tag.core.status import EventKind, Status, frames_placed
from vislam2tag.intake.ids import IdShift
from vislam2tag.site.georeference import Georeference

RUN_FILE = "run.json"
"""Marks an output folder as ours and says what the run follows from; written first."""
PROGRAM = "vislam2tag"
"""What that file calls us."""
RESULTS = "sessions"
SUMMARY_FILE = "summary.json"
"""Totals of a run; written last, so that it marks the run as ended."""
CONFLICTS_PAGE, CONFLICTS_FILE = "conflicts.html", "conflicts.json"
"""Of walks mapped together: how references fit one another, as a page and for programs."""

Polyline = list[tuple[float, float]]
"""BCS points in metres, rounded to the centimetre."""


class FloorRecord(Record):
    """One floor of the site, as ``run.json`` keeps it."""

    number: int
    name: str
    elevation_m: float | None
    width_m: float | None
    height_m: float | None
    lower_left_m: tuple[float, float] = (0.0, 0.0)
    georeference: Georeference | None = None


class FileAccount(Record):
    """One raw file: ``lines = rows +`` the lines counted by findings of unreadable lines."""

    name: str
    role: str
    size_bytes: int
    sha256: str
    lines: int
    rows: int


class Stretch(Record):
    """A drawn run of frames with one status."""

    status: str
    points: Polyline
    sigma_m: list[float] = []
    """Sigma at each point, metres; empty where it is not known."""


class VisitMark(Record):
    """A landmark visit: where the camera was (BCS; None where unmapped) and when."""

    landmark: str
    time_ns: int
    distance_m: float
    position: tuple[float, float] | None
    floor: int | None = None
    """Where that was another floor than the session's own."""


class EventMark(Record):
    """A step of the tracker that is not a motion; ``position`` is where the camera was then (BCS; None where
    unmapped)."""

    time_ns: int
    kind: EventKind
    size_m: float
    turn_rad: float | None
    """Its turn about the vertical; None where it is not known."""
    position: tuple[float, float] | None
    floor: int | None = None
    """Where that was another floor than the session's own."""
    reason: str = ""
    """What the tracker says why, in its own word; empty where it says nothing."""


class ContradictionMark(Record):
    """A landmark that the walk puts elsewhere than the survey does, by all the others."""

    floor: int
    landmark: str
    size_m: float
    sigma_m: float
    """Standard deviation of that size, were the survey right."""
    passes: int
    surveyed_m: tuple[float, float]
    """Where the survey has it (corrections applied), BCS."""
    offset_m: tuple[float, float]
    """From there to where the walk puts it."""


class LandmarkContradiction(Record):
    """A landmark that contradicts the rest, over all sessions."""

    floor: int
    landmark: str
    sessions: int
    """Sessions that say so."""
    seen: int
    """Sessions that logged it."""
    greatest_m: float
    surveyed_m: tuple[float, float]
    offset_m: tuple[float, float]
    """Mean of the sessions' offsets, BCS."""
    room: str = ""
    """What people call the room or corridor where it was surveyed; empty where that has no name."""

    @property
    def called(self) -> str:
        """The landmark and where it hangs, as people say it."""
        return f"landmark {self.landmark} on floor {self.floor}" + (f" ({self.room})" if self.room else "")


class SigmaStatistics(Record):
    """How sure the positions of frames are (``ok`` and ``uncertain`` ones whose sigma is known)."""

    median_m: float
    p95_m: float
    uncertain_share: float
    """Share of these frames whose status is ``uncertain``, 0 to 1."""
    frames: dict[int, int]
    """Number of frames by the bin of their sigma (:mod:`vislam2tag.common.error_statistics`)."""


class SigmaRow(Record):
    """Errors of the labels whose stated sigma falls into one bin."""

    sigma: int | None
    """Bin of the sigma (:mod:`vislam2tag.common.error_statistics`); None where no sigma is stated."""
    sum_m: float
    """Sum of the errors, metres."""
    errors: dict[int, int]
    """Number of errors by the bin of their length."""


class ErrorRecord(Record):
    """Labels against a known truth, reduced to counts, which add up over sessions."""

    sources: dict[str, int]
    """Sessions by where their truth comes from."""
    points: int
    """True points, labelled or not."""
    inside: list[int]
    """Number of errors by the probability of the smallest stated region that contains them, a percent a bin; only
    errors of labels that state a covariance."""
    rows: list[SigmaRow]
    """By sigma, the least first, None before all."""
    truth_part: float = 0.0
    """Sum over the errors in ``inside``: the truth's own share, 0 to 1, of the variance that each should have."""


class ScanStatistics(Record):
    """Wi-Fi scanning of a session."""

    scans: int
    median_interval_s: float | None
    """Median time between the starts of successive scans."""
    readings: int
    repeated: int
    access_points: int


class RecordingRecord(Record):
    """What the recorder says of its own work (the phone app's format)."""

    ended: str
    """``stopped``, or what else ended it; empty where it is not known."""
    scans_refused: int
    """Wi-Fi scans that the phone's system refused, or that failed."""
    exposure_known: bool
    """Whether frames have the time at which their images were exposed."""
    note: str
    """The collector's."""
    events: dict[str, int]
    """Everything that was logged as it happened, by name."""


class Drawing(Record):
    """Thinned polylines for the report."""

    mapped: list[Stretch] = []
    """Runs of mapped frames (status ok or uncertain), in time order."""
    discarded: list[Stretch] = []
    """Runs of unmapped frames by cause, drawn where the aligned raw trajectory puts them."""
    raw: Polyline = []
    """The whole raw trajectory, aligned to the BCS by one similarity; empty where none can be found."""
    wifi: Polyline = []
    """Mean labelled position of each Wi-Fi scan."""


class PassesRecord(Record):
    """Passes of landmarks in the tracker's own frame, in the order of time: input to the search for faults of the
    survey.

    Each list has an entry a pass, but ``drift``, which has one between two; metres and seconds.
    """

    landmark: list[str]
    time_s: list[float]
    camera: Polyline
    offset: Polyline
    """From the camera to the landmark."""
    sighting_m2: list[float]
    drift: list[list[float]]
    """Covariances, row by row, of how far the tracker may have drifted: x, y, scale and heading."""
    places: dict[str, tuple[int, float, float]]
    """Floor, x and y of the surveyed landmarks that the session may use."""
    id_shift: IdShift | None = None
    """By which constant its ids are shifted against the table's; None if they are not."""


class CandidatePath(Record):
    """One of the paths that a walk may have taken on the plan; a point for each stretch of about 12 m."""

    weight: float
    """Its probability, 0 to 1."""
    points: Polyline


class PlacingRecord(Record):
    """How a walk was placed on the floor's plan by its shape (docs/explanation/floor_plan.md)."""

    labelled_share: float
    """Share of its stretches whose place is certain, 0 to 1."""
    reason: str
    """Why nothing of it is labelled, as a status; ``ok`` if something is."""
    way_m: float
    misfit: float
    """Cost of the best path, nats per 10 m; more than 0.25 is refused."""
    mirror: float
    """By how many nats the plan prefers the walk to its mirror image; below 3 (7 at a misfit of 0.25) is refused."""
    exchanged: float
    """The same against the walk with left and right exchanged from its middle on; less than 1 is refused."""
    floors: dict[int, float] = {}
    """The same against other floors' plans, by number; less than 1.5 is refused."""
    scale: float | None = None
    """Size of the plan by the tracker: 1.02 means that it is 2 % too large; None if nothing is labelled."""
    scale_sigma: float | None = None
    time_ns: list[int] = []
    """Moments of the candidates' points."""
    candidates: list[CandidatePath] = []
    """The most probable first; empty if all of the walk is certain."""
    best_tap_ns: int | None = None
    """When a tap on the plan would help most; None if none helps or is needed."""

    @property
    def refused(self) -> bool:
        """Whether nothing of the walk is labelled."""
        return self.reason != Status.OK.label

    def best_tap_s(self, start_ns: int) -> float | None:
        """When a tap would help most, seconds since the walk's first frame; None if none helps or is needed."""
        return None if self.best_tap_ns is None else round((self.best_tap_ns - start_ns) * 1e-9, 2)


class SessionResult(Result):
    """Everything about one processed session except its tables."""

    slug: str
    """File-name stem of the session's outputs."""
    fingerprint: str
    """SHA-256 over input files, landmarks, corrections, settings and the source that computes: unchanged means done."""
    parts: dict[str, str] = {}
    """Of the fingerprint's parts, SHA-256 of ``code`` and ``settings``; empty where they are not known."""
    floor: int
    device: str
    session: str
    format: str
    strategy: str
    version: str
    error: str | None = None
    """Why the session could not be read or mapped; None where it could."""
    from_outside: bool = False
    """Whether links lead to any of its files outside the survey: a data set then leaves the session out."""
    files: list[FileAccount] = []
    findings: list[Finding] = []
    start_ns: int | None = None
    """Time of its first frame, from which moments count in corrections; None if no frame is usable."""
    duration_s: float = 0.0
    distance_m: float = 0.0
    """Length of the walk: mapped where mapped, raw elsewhere, metres."""
    frame_rate_hz: float | None = None
    pose_lag_s: float | None = None
    """Estimated lag of the pose stamps behind the gyroscope's; None where it cannot be estimated."""
    frames: dict[str, int] = {}
    """Number of frames by status."""
    frame_seconds: dict[str, float] = {}
    """Seconds of the walk by status."""
    readings: dict[str, dict[str, int]] = {}
    """For each table the number of rows by status."""
    visits: list[VisitMark] = []
    landmarks_logged: list[str] = []
    floors_told: list[int] = []
    """Floors that the walker said to be on."""
    scans: ScanStatistics | None = None
    recording: RecordingRecord | None = None
    """None where the recorder says nothing of itself."""
    events: list[EventMark] = []
    contradictions: list[ContradictionMark] = []
    sigma: SigmaStatistics | None = None
    """None where the strategy states no uncertainty, or nothing is mapped."""
    max_sigma_m: float | None = None
    """The sigma above which its readings are uncertain, where it is not the run's own limit: in sessions without
    poses; metres."""
    errors: ErrorRecord | None = None
    """None where no truth is known; never used to map."""
    drawing: Drawing = Drawing()
    """What is on the session's own floor."""
    elsewhere: dict[int, Drawing] = {}
    """What is on each other floor that the walk led to."""
    corrections: list[str] = []
    """Each use of corrections.toml, one sentence each."""
    passes: PassesRecord | None = None
    """None where the session has too few frames."""
    placing: PlacingRecord | None = None
    """None where the walk was not placed on the plan."""

    @property
    def unplaced(self) -> bool:
        """Whether it was read and mapped, but no frame has a position."""
        return self.error is None and not frames_placed(self.frames)


WRONG_IDS = ("other_ids", "shifted_ids")
"""Kinds of findings that say that walks and landmark tables have different ids."""


class Summary(Result):
    """Totals of a run (``summary.json``)."""

    version: str
    strategy: str
    sessions: int
    failed: int
    unplaced: int = 0
    """Sessions that did not fail, but have no position."""
    duration_s: float
    distance_m: float
    frames: dict[str, int]
    frame_seconds: dict[str, float]
    """Seconds of all walks by status."""
    readings: dict[str, dict[str, int]]
    findings: dict[str, int]
    """Total count by kind, over the sessions."""
    site_findings: dict[str, int] = {}
    """Total count by kind, about the site's own files, folders and corrections."""
    failures: dict[str, str]
    """Error of each session that could not be read or mapped, by slug."""
    events: dict[str, int] = {}
    """Events of the tracker by kind, over all sessions."""
    contradictions: list[LandmarkContradiction] = []
    """Landmarks that contradict the rest, those that most sessions say it of first."""
    sigma: SigmaStatistics | None = None
    errors: ErrorRecord | None = None
    faults: list[str] = []
    """What is wrong with the survey, by the walks themselves (`vislam2tag diagnose`)."""
    lost: list[str] = []
    """Sessions, files and messages of the first findings that readings or positions are lost by."""
    judgement: Judgement = NOT_RUN
    """Whether the walks could show such faults: an empty list of ``faults`` is not an answer."""
    per_floor: dict[str, dict[str, float]]
    per_device: dict[str, dict[str, float]]

    @property
    def has_wrong_ids(self) -> bool:
        """Whether walks and landmark tables have different ids, or ids that are shifted."""
        return any(kind in counts for kind in WRONG_IDS for counts in (self.findings, self.site_findings))

    @property
    def mapped(self) -> int:
        """How many sessions have a position."""
        return self.sessions - self.failed - self.unplaced

    @property
    def frames_placed(self) -> int:
        """How many frames have a position, certain or not."""
        return frames_placed(self.frames)

    @property
    def problem(self) -> str | None:
        """Why the run is not a success, a clause; None if all sessions were mapped by the right ids, to any
        position."""
        if self.failed:
            return next(iter(self.failures.values()), f"{counted(self.failed, 'session')} could not be read or mapped")
        if self.has_wrong_ids:
            return "walks and landmark tables have different ids; vislam2tag inspect names them"
        if "unknown_in_corrections" in self.site_findings:
            return "corrections.toml names something that does not exist"
        return None if self.frames_placed else "no frame has a position"
