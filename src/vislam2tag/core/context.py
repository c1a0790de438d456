"""The state that a tracker logs at each frame, if it does."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property

from vislam2tag.core.arrays import BoolArray, FloatArray, IntArray
from vislam2tag.core.wall_costs import WallCosts


@dataclass(frozen=True)
class TrackerState:
    """State of the tracker at ``n`` frames: ``tracking`` (n,) mask. ``section`` (n,) int: between frames of different
    sections the tracker restarted, and nothing connects them. ``failure`` (n,) index into ``failures``, the tracker's
    words for why it lost track.
    """

    tracking: BoolArray
    section: IntArray
    failures: tuple[str, ...]
    failure: IntArray

    def reason(self, first: int, after: int) -> str:
        """The commonest reason among the frames ``first`` to ``after`` (excluded) that were lost; empty where none."""
        lost = ~self.tracking[first:after]
        words = [self.failures[i] for i in self.failure[first:after][lost].tolist()]
        words = [word for word in words if word != NO_FAILURE]
        return max(sorted(set(words)), key=words.count) if words else ""


NO_FAILURE = "NONE"
"""The tracker's word for no failure."""


@dataclass(frozen=True)
class AnchorLog:
    """Poses of points that the tracker keeps fixed in its map, ``k`` rows sorted by (anchor, frame).

    ``anchor`` (k,) number; ``frame`` (k,) index into the camera track; ``position_acs`` (k, 3) metres;
    ``orientation_acs`` (k, 4) quaternion (x, y, z, w). They are never looked at: they move only with the map.
    """

    anchor: IntArray
    frame: IntArray
    position_acs: FloatArray
    orientation_acs: FloatArray


@dataclass(frozen=True)
class Storeys:
    """The floors of a building, ``s`` of them, in order of their numbers.

    ``number`` (s,) int; ``elevation_m`` (s,) metres above the building's zero, NaN where unknown; ``own`` is the floor
    that a session is under: where it starts.
    """

    own: int
    number: IntArray
    elevation_m: FloatArray


@dataclass(frozen=True)
class PressureLog:
    """Air pressure beside a walk: ``time_ns`` (p,) boot clock, strictly increasing; ``pressure_hpa`` (p,), finite."""

    time_ns: IntArray
    pressure_hpa: FloatArray


@dataclass(frozen=True)
class InertialLog:
    """Inertial readings beside a walk, boot clock; the times of each sensor increase strictly.

    ``force_ns`` (a,) and ``force`` (a, 3): accelerometer, m/s^2, gravity included. ``rate_ns`` (g,) and ``rate``
    (g, 3): gyroscope, rad/s. ``orientation_ns`` (r,) and ``orientation`` (r, 4): rotation vector as a unit quaternion
    (x, y, z, w), device to east-north-up; empty where there is none. All are finite, in the device's axes.
    """

    force_ns: IntArray
    force: FloatArray
    rate_ns: IntArray
    rate: FloatArray
    orientation_ns: IntArray
    orientation: FloatArray


@dataclass(frozen=True)
class ToldFloors:
    """Moments at which the walker said to be on another floor now: ``time_ns`` (k,) boot clock, in time order;
    ``floor`` (k,) int, its number.
    """

    time_ns: IntArray
    floor: IntArray


@dataclass(frozen=True)
class FixLog:
    """Moments at which the walker's position was known: ``time_ns`` (k,) increasing strictly, ``position_bcs`` (k, 2)
    metres; ``name`` (k,) is what each is called; ``sigma_m`` (k,) per axis, metres, is its standard
    deviation: NaN, or None for all, if none is stated.
    """

    time_ns: IntArray
    position_bcs: FloatArray
    name: tuple[str, ...]
    sigma_m: FloatArray | None = None


@dataclass(frozen=True)
class WalkedWays:
    """Where walks led on a floor, at ``w`` moments: ``position_bcs`` (w, 2) metres, ``course_rad`` (w,) from the BCS x
    axis, ``walk`` (w,) number of the walk.
    """

    position_bcs: FloatArray
    course_rad: FloatArray
    walk: IntArray


@dataclass(frozen=True)
class PlaceTies:
    """Where other walks say that a walk was, at ``k`` moments of it.

    ``time_ns`` (k,) boot clock, in time order; ``position_bcs`` (k, 2) metres; ``covariance_m2`` (2k, 2k) of x and y
    of each, were the landmarks where they are taken to be: moments near each other share errors.
    """

    time_ns: IntArray
    position_bcs: FloatArray
    covariance_m2: FloatArray


@dataclass(frozen=True, eq=False)
class PlanOfFloor:
    """The plan of one floor of the building, in the floor's own BCS; it is read when it is asked for."""

    number: int
    read: Callable[[], WallCosts | None]

    @cached_property
    def costs(self) -> WallCosts | None:
        """Costs of walking through its walls; None if the plan cannot be used."""
        return self.read()


@dataclass(frozen=True)
class PossiblePosition:
    """A moment at which other walks say where a walk may have been: ``position_bcs`` (k, 2) metres, each to
    ``sigma_m`` per axis, with probabilities ``weight`` (k,) that sum to at most 1; the rest says nothing.
    """

    time_ns: int
    position_bcs: FloatArray
    weight: FloatArray
    sigma_m: float


@dataclass(frozen=True)
class PlacingHints:
    """What other walks of a floor say of a walk that is placed on its plan.

    ``north_rad`` is ``bcs_R_enu``, the direction of east from the plan's x axis; None if it is not known.
    """

    places: tuple[PossiblePosition, ...] = ()
    north_rad: float | None = None


@dataclass(frozen=True)
class TrackerNoise:
    """How noisy a walk's tracker is by other walks of its device, and by other devices of the survey.

    It sees landmarks, and drifts, ``times_usual`` as badly as usual (standard deviations); for a further walk that
    counts as much as so many ``effective_observations``.
    """

    times_usual: float
    effective_observations: float
