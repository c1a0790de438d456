"""The tracker: from event to event, it moves its map and logs where it holds camera and landmarks to be."""

from __future__ import annotations

import cmath
from collections import defaultdict
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from scipy.signal import lfilter

from second_generator.events import Event, Kind
from second_generator.gait import Motion
from second_generator.habits import Habits
from second_generator.odometry import Odometry
from second_generator.random_numbers import direction
from second_generator.sightings import Errors, Pass, seen_at
from second_generator.tracker_map import Rigid, TrackerMap, scatter_unevenly
from vislam2tag.core.arrays import BoolArray, ComplexArray

UNSEEN_S = 8.0
"""A landmark unseen for that long is seen again rather than still."""


@dataclass(frozen=True)
class World:
    """What is true in the BCS: ``n`` frames, ``m`` sheets."""

    motion: Motion
    sheets: ComplexArray
    """(n, m) where each sheet hangs at each frame, metres."""
    along_wall: ComplexArray
    """(m,) directions of the sheets' X axes."""

    @property
    def offsets(self) -> ComplexArray:
        """(n, m) from the camera to each sheet."""
        return np.asarray(self.sheets - self.motion.place[:, None])


@dataclass(frozen=True)
class Logged:
    """What the tracker holds to be where at each frame, in its own frame."""

    camera: ComplexArray
    """(n,) metres."""
    turn: ComplexArray
    """(n,) scale and turn of small BCS vectors at the camera."""
    landmarks: ComplexArray
    """(n, m) metres, NaN before the first sighting."""
    along_wall: ComplexArray
    """(n, m) the sheets' X axes, NaN before the first sighting."""

    @classmethod
    def empty(cls, frames: int, landmarks: int) -> Logged:
        """Room for that many."""
        unknown = np.full((frames, landmarks), np.nan + 0j)
        return cls(np.empty(frames, np.complex128), np.empty(frames, np.complex128), unknown, unknown.copy())


@dataclass(frozen=True)
class Kidnapped:
    """Where the odometry's frame was before, and since when it is not."""

    from_odometry: Rigid
    frame: int


class Tracker:
    """One walk of the tracker; :meth:`run` may be called once."""

    def __init__(
        self,
        world: World,
        odometry: Odometry,
        passes: list[Pass],
        errors: Errors,
        habits: Habits,
        rng: np.random.Generator,
    ) -> None:
        frames, landmarks = world.sheets.shape
        self._world, self._odometry, self._passes, self._errors = world, odometry, passes, errors
        self._habits, self._rng = habits, rng
        self._seen: BoolArray = seen_at(passes, world.sheets.shape)
        start = complex(odometry.from_bcs[0] / abs(odometry.from_bcs[0]))
        from_bcs = Rigid(start, complex(odometry.place[0] - start * world.motion.place[0]))
        self._map = TrackerMap.empty(from_bcs, landmarks)
        self._logged = Logged.empty(frames, landmarks)
        self._kidnapped: Kidnapped | None = None

    def run(self, events: list[Event]) -> Logged:
        """Go through events and passes in order."""
        happening: dict[int, list[Kind]] = defaultdict(list)
        arriving: dict[int, list[int]] = defaultdict(list)
        for event in events:
            happening[event.frame].append(event.kind)
        for one in self._passes:
            arriving[int(one.frames[0])].append(one.sheet)
        for frame, following in pairwise(sorted({0, len(self._seen), *happening, *arriving})):
            for kind in happening[frame]:
                self._happen(frame, kind)
            for sheet in arriving[frame]:
                self._arrive(frame, sheet)
            self._log(frame, following)
        return self._logged

    def _camera_at(self, frame: int) -> complex:
        return self._map.from_odometry(complex(self._odometry.place[frame]))

    def _turn_at(self, frame: int) -> complex:
        """Scale and turn of small BCS vectors into the tracker's frame."""
        return self._map.from_odometry.turn * complex(self._odometry.from_bcs[frame])

    def _happen(self, frame: int, kind: Kind) -> None:
        rng, camera = self._rng, self._camera_at(frame)
        if kind is Kind.UPDATE:
            self._update(camera)
        elif kind is Kind.BREAK:
            turn_rad = rng.normal(0, 0.04) if rng.random() < 0.5 else 0.0
            self._map.displace_camera(Rigid.about(camera, turn_rad, rng.uniform(0.2, 1.0) * direction(rng)))
        elif kind is Kind.KIDNAP:
            self._kidnap(frame, camera)
        elif kind is Kind.RECOVERY and self._kidnapped is not None:
            share = 1.0 if rng.random() < 0.5 else rng.uniform(0.4, 1.1)
            self._take_back(frame, self._kidnapped.from_odometry, share, self._kidnapped.frame)
            self._kidnapped = None
        elif kind is Kind.CORRECTION:
            self._correct_drift(frame, camera)

    def _update(self, camera: complex) -> None:
        """Re-express camera and landmarks; most updates are small, some uneven."""
        habits, rng = self._habits.updates, self._rng
        size_m = habits.size_m * rng.gamma(1.2)
        motion = Rigid.about(camera, habits.turn_rad * rng.standard_t(3), size_m * direction(rng))
        uneven = rng.random() < habits.uneven
        spread_m = min(size_m * rng.uniform(0.05, 0.5), 1.0) if uneven else 0.0
        scatter = scatter_unevenly(len(self._map.landmarks), spread_m, rng)
        self._map.express_anew(motion, camera, 1 + habits.scale * rng.standard_normal(), scatter)
        if self._kidnapped is not None:
            self._kidnapped = Kidnapped(motion.after(self._kidnapped.from_odometry), self._kidnapped.frame)

    def _kidnap(self, frame: int, camera: complex) -> None:
        """Move the camera alone; the tracker remembers where it was, unless the kidnap is for good."""
        habits, rng = self._habits.kidnaps, self._rng
        if self._kidnapped is not None:
            return
        if habits.end != "never":
            self._kidnapped = Kidnapped(self._map.from_odometry, frame)
        jump = habits.size_m * rng.uniform(0.7, 1.3) * direction(rng)
        self._map.displace_camera(Rigid.about(camera, habits.turn_rad * rng.standard_normal(), jump))

    def _correct_drift(self, frame: int, camera: complex) -> None:
        """Take back a share of all drift since a landmark was last seen, or since the start."""
        ideal, known = self._map.from_bcs, self._map.last_seen[self._map.last_seen >= 0]
        since = int(self._rng.choice(known)) if len(known) else 0
        share = self._rng.uniform(0.2, 1.0)
        jump = ideal(complex(self._world.motion.place[frame])) - camera
        turn_rad = cmath.phase(ideal.turn / self._turn_at(frame))
        self._correct(frame, share * turn_rad, share * jump, since)

    def _take_back(self, frame: int, from_odometry: Rigid, share: float, since: int) -> None:
        """Go back by a share to the frame that the camera had."""
        jump = from_odometry(complex(self._odometry.place[frame])) - self._camera_at(frame)
        turn_rad = cmath.phase(from_odometry.turn / self._map.from_odometry.turn)
        self._correct(frame, share * turn_rad, share * jump, since)

    def _correct(self, frame: int, turn_rad: float, jump: complex, since: int) -> None:
        share = self._map.share_since(since, frame)
        if self._rng.random() < 0.3:
            share = (share > 0.5).astype(np.float64)
        self._map.correct(self._camera_at(frame), turn_rad, jump, share)

    def _arrive(self, frame: int, sheet: int) -> None:
        """A pass begins: it may end a kidnap, or correct the drift since the landmark was last seen."""
        habits, since, time_s = self._habits, int(self._map.last_seen[sheet]), self._world.motion.time_s
        if since < 0 or time_s[frame] - time_s[since] < UNSEEN_S:
            return
        offset = complex(self._world.sheets[frame, sheet] - self._world.motion.place[frame])
        drift = complex(self._map.landmarks[sheet]) - (self._camera_at(frame) + self._turn_at(frame) * offset)
        if self._kidnapped is not None and habits.kidnaps.end == "landmark" and since < self._kidnapped.frame:
            turn_rad = cmath.phase(self._kidnapped.from_odometry.turn / self._map.from_odometry.turn)
            self._correct(frame, turn_rad, drift, self._kidnapped.frame)
            self._kidnapped = None
        elif self._rng.random() < habits.corrections.at_revisit:
            self._correct(frame, 0.0, self._rng.uniform(0.2, 1.0) * drift, since)

    def _log(self, first: int, stop: int) -> None:
        """Log the frames from ``first`` to ``stop``, where nothing happens but sightings."""
        span, logged, tracker = slice(first, stop), self._logged, self._map
        logged.camera[span] = tracker.from_odometry(self._odometry.place[span])
        logged.turn[span] = tracker.from_odometry.turn * self._odometry.from_bcs[span]
        logged.landmarks[span], logged.along_wall[span] = tracker.landmarks, tracker.along_wall
        for sheet in np.flatnonzero(self._seen[span].any(axis=0)).tolist():
            self._sight(first, stop, sheet)

    def _sight(self, first: int, stop: int, sheet: int) -> None:
        """Log a landmark that is sighted; from a sighting on it stays where it was held to be."""
        tracker, logged, world = self._map, self._logged, self._world
        frames = first + np.flatnonzero(self._seen[first:stop, sheet])
        turn = logged.turn[frames]
        offset = world.sheets[frames, sheet] - world.motion.place[frames] + self._errors.place[frames, sheet]
        place = self._settled(logged.camera[frames] + turn * offset, complex(tracker.landmarks[sheet]))
        along = turn / abs(turn) * world.along_wall[sheet] * np.exp(1j * self._errors.heading_rad[frames, sheet])
        known = np.arange(frames[0], stop)
        latest = np.searchsorted(frames, known, side="right") - 1
        logged.landmarks[known, sheet], logged.along_wall[known, sheet] = place[latest], along[latest]
        tracker.landmarks[sheet], tracker.along_wall[sheet] = place[-1], along[-1]
        tracker.last_seen[sheet] = frames[-1]

    def _settled(self, sighted: ComplexArray, before: complex) -> ComplexArray:
        """Sightings (k,) as the tracker takes them up from where it held the landmark to be."""
        settling = self._habits.errors.settling
        if settling == 1 or not np.isfinite(before):
            return sighted
        share = 1 - (1 - settling) ** (30 / self._habits.gait.rate_hz)
        settled, _ = lfilter([share], [1, share - 1], sighted, zi=[(1 - share) * before])
        return np.asarray(settled)
