"""The tracker's map: where it holds the odometry and the landmarks to be in its own frame."""

from __future__ import annotations

import cmath
from dataclasses import dataclass
from typing import TypeVar

import numpy as np

from second_generator.random_numbers import normal_plane
from vislam2tag.core.arrays import ComplexArray, FloatArray, IntArray

Place = TypeVar("Place", complex, ComplexArray)


@dataclass(frozen=True)
class Rigid:
    """The motion ``x -> turn * x + shift`` of the plane; ``turn`` has size 1."""

    turn: complex
    shift: complex

    @classmethod
    def about(cls, pivot: complex, turn_rad: float, jump: complex) -> Rigid:
        """Turn about a pivot, which itself jumps."""
        turn = cmath.exp(1j * turn_rad)
        return cls(turn, pivot + jump - turn * pivot)

    def __call__(self, place: Place) -> Place:
        """Move a place, or places."""
        return self.turn * place + self.shift

    def after(self, first: Rigid) -> Rigid:
        """Both motions, ``first`` first."""
        return Rigid(self.turn * first.turn, self(first.shift))


@dataclass
class TrackerMap:
    """The map at one moment; changes move the camera's frame, landmarks or both."""

    from_odometry: Rigid
    """Odometry's frame to ACS."""
    from_bcs: Rigid
    """BCS to ACS as if there were no drift, breaks and kidnaps: what corrections aim at."""
    landmarks: ComplexArray
    """(m,) ACS metres, NaN before the first sighting."""
    along_wall: ComplexArray
    """(m,) the sheets' X axes."""
    last_seen: IntArray
    """(m,) frame, -1 before the first sighting."""

    @classmethod
    def empty(cls, from_bcs: Rigid, landmarks: int) -> TrackerMap:
        """Begin a map in the odometry's frame."""
        unknown = np.full(landmarks, np.nan + 0j)
        return cls(Rigid(1.0, 0.0), from_bcs, unknown, unknown.copy(), np.full(landmarks, -1))

    def displace_camera(self, motion: Rigid) -> None:
        """Move the camera alone."""
        self.from_odometry = motion.after(self.from_odometry)

    def express_anew(self, motion: Rigid, pivot: complex, scale: float, scatter: ComplexArray) -> None:
        """Move camera and landmarks; landmarks are also scaled about the pivot and scattered (m,)."""
        moved = motion(self.landmarks)
        self.landmarks = motion(pivot) + scale * (moved - motion(pivot)) + scatter
        self.along_wall = motion.turn * self.along_wall
        self.displace_camera(motion)
        self.from_bcs = motion.after(self.from_bcs)

    def correct(self, pivot: complex, turn_rad: float, jump: complex, share: FloatArray) -> None:
        """Move the camera, and each landmark by its share (m,) of that."""
        turn = np.exp(1j * share * turn_rad)
        self.landmarks = (self.landmarks - pivot) * turn + pivot + share * jump
        self.along_wall = turn * self.along_wall
        self.displace_camera(Rigid.about(pivot, turn_rad, jump))

    def share_since(self, since: int, frame: int) -> FloatArray:
        """Shares (m,) of a correction that reaches back to a frame: the greater, the later a landmark was seen."""
        share = ((self.last_seen - since) / max(frame - since, 1)).clip(0, 1)
        return np.where(self.last_seen >= 0, share, 0.0)


def scatter_unevenly(landmarks: int, spread_m: float, rng: np.random.Generator) -> ComplexArray:
    """Draw by how much (m,) an uneven update moves landmarks unlike the camera: together, apart, or both."""
    together = spread_m * normal_plane(rng, 1) * (rng.random() < 0.5)
    return np.asarray(together + 0.5 * spread_m * rng.uniform(0, 1) * normal_plane(rng, landmarks))
