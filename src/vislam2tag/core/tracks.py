"""What one session gives to a mapping strategy, and what it gets back.

Frames of reference: **ACS** is the tracker's own frame (right-handed, y up, metres), **BCS** the building
frame of a floor (x right, y up on the plan, z up, metres). The horizontal plane of the ACS is the
right-handed 2-D frame ``(tx, -tz)``.

Places as people on site find them: by the landmarks that hang near.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np

from vislam2tag.core.arrays import BoolArray, FloatArray, IntArray, StatusArray, of_landmarks, with_rows
from vislam2tag.core.cell_grid import WalkableArea
from vislam2tag.core.context import (
    AnchorLog,
    FixLog,
    InertialLog,
    PlaceTies,
    PlacingHints,
    PlanOfFloor,
    PressureLog,
    Storeys,
    ToldFloors,
    TrackerNoise,
    TrackerState,
    WalkedWays,
)
from vislam2tag.core.notebook import Drawable, Summarised
from vislam2tag.core.placing import Placing
from vislam2tag.core.status import Contradiction, Status, TrackerEvent


def _no_rows() -> IntArray:
    """An empty (0,) array."""
    return np.empty(0, dtype=np.int64)


@dataclass(frozen=True, eq=False)
class CameraTrack:
    """Camera poses of a session in file order, ``n`` frames; compared by identity.

    ``time_ns`` (n,) int64 boot-clock nanoseconds. ``position_acs`` (n, 3) metres. ``orientation_acs`` (n, 4) unit
    quaternion (x, y, z, w), camera to ACS. ``status`` (n,) codes: OK for usable frames, DUPLICATE for a repeated time
    (the first counts), INVALID for a backward time, a number that is not finite or an excluded span. Usable frames have
    strictly increasing times.
    """

    time_ns: IntArray
    position_acs: FloatArray
    orientation_acs: FloatArray
    status: StatusArray
    row: IntArray = field(default_factory=_no_rows)
    """(n,) 1-based line of the raw file; empty where the frames come from no file."""
    pressure: PressureLog | None = None
    """Air pressure on the same clock; None where none was logged."""
    pose_lag_s: float | None = None
    """How much later than exposed poses are stamped, by the gyroscope, seconds; None if unknown."""
    exposure_known: bool = False
    """Whether times are those of the exposure, so that there is no lag."""
    state: TrackerState | None = None
    """What the tracker said of itself; None if the log does not contain it."""
    anchors: AnchorLog | None = None
    """Points that the tracker held fixed in its map; None where none were logged."""
    told_floors: ToldFloors | None = None
    """Where the walker said to have come to another floor; None where no one said so."""
    inertial: InertialLog | None = None
    """Inertial readings on the same clock; None where none were logged."""
    fixes: FixLog | None = None
    """Where the walker is known to have been; None where no one said."""
    area: WalkableArea | None = None
    """Where the session's floor can be walked, for walks without a tracker; None if no drawing shows it."""

    ways: WalkedWays | None = None
    """Where other walks led on the session's floor, for walks without a tracker; None where it is mapped alone."""
    ties: PlaceTies | None = None
    """Where other walks say that this one was; None where it is mapped without them."""
    tracker: TrackerNoise | None = None
    """How noisy the device's tracker is, estimated from its other walks; None if unknown."""
    plans: tuple[PlanOfFloor, ...] = ()
    """Plans of the building's floors; empty where walks are not placed by them."""
    own_floor: int = 0
    """Number of the session's floor, of which ``plans`` may have a plan."""
    hints: PlacingHints | None = None
    """What other walks say of the place of one that a plan places; None where it is mapped alone."""

    @property
    def usable(self) -> BoolArray:
        """Mask (n,) of the frames that mapping may use."""
        mask: BoolArray = self.status == 0
        return mask

    @property
    def without_poses(self) -> bool:
        """Whether there was no tracker: no frame has a pose, and they stand for moments of the inertial readings."""
        return self.inertial is not None and not self.tracked

    @property
    def tracked(self) -> bool:
        """Whether any frame has a pose."""
        return bool(np.isfinite(self.position_acs).any())

    @property
    def duration_s(self) -> float:
        """Seconds from the first usable frame to the last; 0 where there are none."""
        time_ns = self.time_ns[self.usable]
        return float(time_ns[-1] - time_ns[0]) * 1e-9 if len(time_ns) else 0.0

    @property
    def frame_rate_hz(self) -> float | None:
        """Usual frame rate, by the median step between usable frames (a hole does not lower it); None below two."""
        time_ns = self.time_ns[self.usable]
        return 1e9 / float(np.median(np.diff(time_ns))) if len(time_ns) > 1 else None

    @property
    def plane_acs(self) -> FloatArray:
        """Horizontal camera positions (n, 2), ``(tx, -tz)``, metres."""
        return to_plane(self.position_acs)


@dataclass(frozen=True, eq=False)
class LandmarkLog:
    """All logged landmark poses of a session in long form, ``k`` rows sorted by (landmark, frame).

    ``ids``: the m landmark ids logged, in order of first sighting. ``landmark`` (k,) index into ``ids``. ``frame`` (k,)
    index into the camera track; at most one row per (landmark, frame), only usable frames. ``position_acs`` (k, 3)
    metres; ``orientation_acs`` (k, 4) quaternion (x, y, z, w), landmark to ACS. Rows of lost tracking (pose equal to
    the camera's) are kept: use :attr:`lost`. Compared by identity.
    """

    ids: tuple[str, ...]
    landmark: IntArray
    frame: IntArray
    position_acs: FloatArray
    orientation_acs: FloatArray
    lost: BoolArray
    """(k,) mask: the logged position equals the camera's, i.e. the tracker had lost this landmark."""
    row: IntArray = field(default_factory=_no_rows)
    """(k,) 1-based line of the raw file; empty where the rows come from no file."""
    seen: BoolArray | None = None
    """(k,) mask of the rows in which the tracker says that it saw the landmark; None if the log does not contain it."""

    @cached_property
    def offsets(self) -> IntArray:
        """(m + 1,) start of each landmark's rows; rows of landmark i are ``offsets[i]:offsets[i + 1]``."""
        return np.searchsorted(self.landmark, np.arange(len(self.ids) + 1)).astype(np.int64)

    def rows_of(self, index: int) -> slice:
        """Rows of the landmark with this index in ``ids``."""
        return slice(int(self.offsets[index]), int(self.offsets[index + 1]))

    def select(self, wanted: list[int]) -> LandmarkLog:
        """Keep only the landmarks with these indices (ascending)."""
        return self._part(wanted, np.ones(len(self.landmark), dtype=bool))

    def rows_kept(self, rows: BoolArray) -> LandmarkLog:
        """Keep the rows of a mask (k,); landmarks without any left go."""
        return self._part(np.unique(self.landmark[rows]).tolist(), rows)

    def _part(self, wanted: list[int], rows: BoolArray) -> LandmarkLog:
        """Keep the rows of a mask (k,) that belong to the landmarks with these indices (ascending)."""
        renumber = np.full(len(self.ids), -1, dtype=np.int64)
        renumber[wanted] = np.arange(len(wanted))
        landmark = renumber[self.landmark]
        keep = np.flatnonzero((landmark >= 0) & rows)
        if len(wanted) == len(self.ids) and len(keep) == len(landmark):
            return self
        log = replace(self, ids=tuple(self.ids[i] for i in wanted), landmark=landmark)
        return with_rows(log, keep, "landmark", "frame", "position_acs", "orientation_acs", "lost", "row", "seen")

    @property
    def plane_acs(self) -> FloatArray:
        """Horizontal landmark positions (k, 2), ``(tx, -tz)``, metres."""
        return to_plane(self.position_acs)


_OF_EACH_LANDMARK = (
    "floor",
    "position_bcs",
    "covariance_bcs",
    "z_m",
    "heading_rad",
    "heading_sigma_rad",
    "planned",
)


@dataclass(frozen=True, repr=False)
class Landmarks(Summarised):
    """Landmarks of a site in the BCS, ``m`` of them.

    ``position_bcs`` (m, 2) metres; ``covariance_bcs`` (m, 2, 2) m^2, infinite on the diagonal where unsurveyed;
    ``z_m`` (m,), ``heading_rad`` (m,) direction of the sheet's X axis from the BCS x axis, ``heading_sigma_rad``
    (m,): NaN where unknown. ``floor`` (m,) int.
    """

    ids: tuple[str, ...]
    floor: IntArray
    position_bcs: FloatArray
    covariance_bcs: FloatArray
    z_m: FloatArray
    heading_rad: FloatArray
    heading_sigma_rad: FloatArray
    source: tuple[str, ...] = ()
    """(m) file and 1-based line of each, ``floor_1/marker_dict.csv:3``; empty where they come from no file."""
    storeys: Storeys | None = None
    """The building's floors as the session sees them; None where no one asks for heights."""
    joint_covariance: FloatArray | None = None
    """(3m, 3m) of x, y of each, then of all headings (m^2, m rad, rad^2), where landmarks share errors; rows of what is
    unknown mean nothing. None where they err apart, by ``covariance_bcs`` and ``heading_sigma_rad`` alone."""
    planned: BoolArray = field(default_factory=lambda: np.zeros(0, dtype=bool))
    """(m,) whether a position was only planned, not measured; empty if none was."""

    def _facts(self) -> dict[str, object]:
        floors = ", ".join(map(str, np.unique(self.floor).tolist()))
        return {"landmarks": len(self.ids), "surveyed": int(self.surveyed.sum()), "floors": floors or "none"}

    @cached_property
    def index(self) -> dict[str, int]:
        """Index of each id."""
        return {landmark_id: i for i, landmark_id in enumerate(self.ids)}

    @cached_property
    def surveyed_ids(self) -> frozenset[str]:
        """Ids of the landmarks with a known position."""
        return frozenset(name for name, surveyed in zip(self.ids, self.surveyed, strict=True) if surveyed)

    def select(self, wanted: list[int]) -> Landmarks:
        """Keep only the landmarks with these indices, in this order."""
        rows = np.asarray(wanted, dtype=np.int64)
        some = replace(
            self,
            ids=tuple(self.ids[i] for i in wanted),
            source=tuple(self.source[i] for i in wanted) if self.source else (),
            joint_covariance=None if self.joint_covariance is None else of_landmarks(self.joint_covariance, rows),
        )
        return with_rows(some, rows, *_OF_EACH_LANDMARK)

    @property
    def planned_ids(self) -> tuple[str, ...]:
        """Ids of the landmarks whose position was only planned, in order."""
        return tuple(self.ids[i] for i in np.flatnonzero(self.planned).tolist())

    def without_planned_positions(self) -> Landmarks:
        """The landmarks with those positions unknown, and their heights and headings, that were only planned."""
        if not self.planned.any():
            return self
        unknown = self.planned
        return replace(
            self,
            position_bcs=np.where(unknown[:, None], np.nan, self.position_bcs),
            covariance_bcs=np.where(unknown[:, None, None], np.diag((np.inf, np.inf)), self.covariance_bcs),
            z_m=np.where(unknown, np.nan, self.z_m),
            heading_rad=np.where(unknown, np.nan, self.heading_rad),
            heading_sigma_rad=np.where(unknown, np.nan, self.heading_sigma_rad),
            joint_covariance=None,
        )

    def on_floor(self, number: int) -> Landmarks:
        """Keep only the landmarks of one floor (ids repeat from floor to floor)."""
        return self.select(np.flatnonzero(self.floor == number).tolist())

    @property
    def surveyed(self) -> BoolArray:
        """Mask (m,) of the landmarks with a known position."""
        numbers = np.column_stack((self.position_bcs, self.covariance_bcs[:, (0, 1), (0, 1)]))
        mask: BoolArray = np.all(np.isfinite(numbers), axis=1)
        return mask


@dataclass(frozen=True)
class Visit:
    """A closest approach to a landmark (paper, section V-B), or a boundary of lost tracking (``landmark`` empty)."""

    frame: int
    landmark: str
    distance_m: float


@dataclass(frozen=True)
class Segment:
    """A sub-trajectory: frames ``start`` (included) to ``stop`` (excluded) that share one transformation or cause."""

    start: int
    stop: int
    status: int
    """A :class:`~vislam2tag.core.status.Status` code: OK, or what discarded the segment."""
    first_landmark: str = ""
    last_landmark: str = ""


@dataclass(frozen=True, repr=False)
class Trajectory(Drawable):
    """A mapped session: one entry for each frame of the camera track, in the same order.

    ``position_bcs`` (n, 3) metres, NaN where there is none (z NaN where no height is known). ``orientation_bcs`` (n, 4)
    quaternion (x, y, z, w), camera to BCS, NaN where unknown. ``covariance_bcs`` (n, 2, 2) m^2, NaN where unknown.
    ``status`` (n,) codes of :class:`~vislam2tag.core.status.Status`: every frame has a position or a cause. ``floor``
    (n,) int is the floor that each frame is on; empty where all lie on the session's own.
    """

    time_ns: IntArray
    position_bcs: FloatArray
    orientation_bcs: FloatArray
    covariance_bcs: FloatArray
    status: StatusArray
    segments: tuple[Segment, ...] = ()
    visits: tuple[Visit, ...] = ()
    floor: IntArray = field(default_factory=_no_rows)
    events: tuple[TrackerEvent, ...] = ()
    """Steps of the tracker that are not motions, by frame; only strategies that look for them report any."""
    contradictions: tuple[Contradiction, ...] = ()
    """Landmarks that contradict the rest, greatest first."""
    passes_left_out: int = 0
    """Passes of landmarks beyond those that can be solved for."""
    fix_contradiction_m: float = 0.0
    """How far the known positions of a walk without a tracker contradict each other, median, metres; 0: they agree."""
    fixes_used: int | None = None
    """How many known positions a walk without a tracker was led through; None if it has a tracker."""
    placing: Placing | None = None
    """How the walk was placed on the floor's plan; None if it was not."""
    not_converged: tuple[str, ...] = ()
    """Parts of it (``path``, ``heights``) that did not converge, each with its estimated distance from the limit."""

    def _facts(self) -> dict[str, object]:
        frames = len(self.time_ns)
        seconds = (self.time_ns[-1] - self.time_ns[0]) / 1e9 if frames else 0.0
        share = f"{100 * float(np.mean(self.status == Status.OK)):.0f} %" if frames else "none"
        return {"frames": frames, "duration": f"{seconds:.1f} s", "labelled": share, "visits": len(self.visits)}

    @property
    def sigma_m(self) -> FloatArray:
        """(n,) one standard deviation per axis, ``sqrt(trace(P) / 2)``, metres; NaN where unknown."""
        sigma: FloatArray = np.sqrt(np.trace(self.covariance_bcs, axis1=1, axis2=2) / 2)
        return sigma


def section_numbers(camera: CameraTrack) -> IntArray:
    """Numbers (s,) of the sections that have usable frames, in order; one if the log has none."""
    if camera.state is None:
        return np.zeros(1, dtype=np.int64)
    return np.unique(camera.state.section[camera.usable])


def one_section(camera: CameraTrack, log: LandmarkLog, section: int) -> tuple[CameraTrack, LandmarkLog]:
    """Take one section of a session alone: frames of the others are INVALID, their landmark rows are gone."""
    if camera.state is None:
        return camera, log
    inside = camera.state.section == section
    status = np.where(inside, camera.status, np.int8(Status.INVALID)).astype(np.int8)
    return replace(camera, status=status), log.rows_kept(inside[log.frame])


def longest_section(camera: CameraTrack, log: LandmarkLog) -> tuple[CameraTrack, LandmarkLog]:
    """Take the section with most usable frames alone; the session as it is where it has one section."""
    sections = section_numbers(camera)
    if len(sections) < 2 or camera.state is None:
        return camera, log
    frames = [int(np.count_nonzero(camera.usable & (camera.state.section == section))) for section in sections]
    return one_section(camera, log, int(sections[int(np.argmax(frames))]))


def to_plane(position_acs: FloatArray) -> FloatArray:
    """Project ACS positions (..., 3) onto the horizontal plane: ``(tx, -tz)`` (..., 2), metres."""
    return np.stack((position_acs[..., 0], -position_acs[..., 2]), axis=-1)


LANDMARKS_NAMED = 2
"""This many landmarks identify a place: two distances leave two places at most."""


def near_landmarks(landmarks: Landmarks, floor: int, place_m: tuple[float, float]) -> str:
    """Name a place (BCS) by the surveyed landmarks of its floor: ``3 m from landmark 9, 12 m from landmark 4``.

    Empty where the floor has none.
    """
    here = landmarks.on_floor(floor)
    away_m = np.linalg.norm(here.position_bcs - np.asarray(place_m), axis=1)
    surveyed = here.surveyed
    rows = [row for row in np.argsort(away_m, kind="stable").tolist() if surveyed[row]]
    return ", ".join(f"{away_m[row]:.0f} m from landmark {here.ids[row]}" for row in rows[:LANDMARKS_NAMED])
