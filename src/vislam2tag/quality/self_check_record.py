"""What a check without ground truth finds, as JSON (``check.json``)."""

from __future__ import annotations

from enum import StrEnum
from typing import ClassVar

from vislam2tag.common.findings import NOT_RUN, Judgement
from vislam2tag.common.records import Record
from vislam2tag.common.tabular import Result
from vislam2tag.site.walkable.walked import WalkedFloor


class LeftOutMark(Record):
    """A landmark predicted without its survey, or, in a session without poses, a fix without its position."""

    floor: int
    landmark: str
    """Its id, or the fix's name."""
    passes: int
    surveyed_m: tuple[float, float]
    """Where the survey has it (corrections applied), BCS."""
    offset_m: tuple[float, float]
    """From there to where the walk without it puts it."""
    covariance_m2: tuple[float, float, float]
    """Variance along x, covariance, variance along y of that offset as stated, the survey's own included."""
    survey_covariance_m2: tuple[float, float, float]


class DoubtfulFix(Record):
    """A known position that the others of its walk contradict."""

    name: str
    """Its place in the session's files."""
    fix_m: tuple[float, float]
    offset_m: tuple[float, float]
    """From there to where the others put the walker."""
    size_m: float
    sigma_m: float
    """Standard deviation per axis of that offset, were the fix right."""


class SessionCheck(Result):
    """One session; metres. The four errors are means over its labels, None where it has none."""

    slug: str
    floor: int
    device: str
    session: str
    error: str | None = None
    """Why it could not be read or mapped; None where it could."""
    landmarks: int = 0
    """Surveyed landmarks that it passed."""
    fixes: int = 0
    """Known positions of a session without poses, which then stand for landmarks."""
    doubtful_fixes: list[DoubtfulFix] = []
    left_out: list[LeftOutMark] = []
    """Those that could be predicted from the others."""
    frames: int = 0
    labelled: int = 0
    """Frames with a label that is certain enough."""
    stated_m: float | None = None
    """Mean error to expect by the smoother's own covariances."""
    estimated_m: float | None = None
    """The same, scaled by what the left-out landmarks show."""
    low_m: float | None = None
    high_m: float | None = None
    """The true mean error is between them in about nine of ten sessions."""
    well_founded: bool = False
    """Whether enough landmarks or fixes could be left out for the estimate to say more than what is stated."""


class Fault(StrEnum):
    """What is wrong with a landmark."""

    OFFSET = "offset"
    """The walks put it elsewhere, at the same place: wrongly surveyed, or moved before the first of them."""
    DOUBT = "doubt"
    """The only walk that shows it puts it elsewhere: the landmark is wrong, or the tracker slipped there."""
    SCATTER = "scatter"
    """The walks do not agree on where it is: moved between them, or two sheets with one id."""


class BadLandmark(Record):
    """A landmark whose left-out errors are too large for chance."""

    floor: int
    landmark: str
    fault: Fault
    sessions: int
    surveyed_m: tuple[float, float]
    offset_m: tuple[float, float]
    """From there to where the walks together put it."""
    size_m: float
    """Length of the offset; for a scattering landmark the median distance of the walks' places from their middle."""
    sigma_m: float
    """Standard deviation of that length, were the survey right."""
    room: str = ""
    """What people call the room or corridor where it was surveyed; empty where that has no name."""


class ProposedPlace(Record):
    """Where one more landmark would help."""

    x_m: float
    y_m: float
    near: str
    """The place as people find it: how far it is from which landmarks; empty where the floor has none."""
    gain_m: float
    """By how much the mean error to expect on the floor would fall."""


class FloorCheck(Record):
    """One floor, over all sessions that were mapped onto it."""

    number: int
    frames: int
    expected_m: float
    """Mean error to expect of all frames, certain or not, as estimated."""
    places: list[ProposedPlace]
    """Where one more landmark would help most, the best first; each gain is that of this landmark alone."""


class SurveyCheck(Result):
    """A whole survey (``check.json``)."""

    main_table: ClassVar[str] = "floors"

    version: str
    max_sigma_m: float | str
    """Labels with a greater sigma are not counted as such."""
    sessions: list[SessionCheck]
    floors: list[FloorCheck]
    bad_landmarks: list[BadLandmark]
    judgement: Judgement = NOT_RUN
    """Whether landmarks and known positions could be compared with one another; ``bad_landmarks`` may be empty if not.
    """
    walked: list[WalkedFloor] = []
    """What of each floor's walkable space was walked; only where it is written to a folder."""

    @property
    def failed(self) -> int:
        """Number of sessions that could not be read or mapped."""
        return sum(session.error is not None for session in self.sessions)

    @property
    def checked(self) -> int:
        """Number of sessions of whose labels an error could be estimated."""
        return sum(session.estimated_m is not None for session in self.sessions)
