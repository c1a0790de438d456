"""A second generator of walks, which shares no code and no assumptions with the simulator.

The walker goes round a loop of corridors, back and forth, and stops at some landmarks. The tracker's heading, scale and
position drift. Each visit of a landmark has an error of its own, and frames jitter about it. Faults come at random
times: map updates move camera and landmarks together, jumps move the camera alone, closed loops take a part of the
drift back over a second, and lost tracking leaves an error behind. A survey has one device; its walks differ in noise
by a quarter.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np
from data_sets import Walk, surveyed_at

from vislam2tag.core.arrays import BoolArray, ComplexArray, FloatArray
from vislam2tag.core.tracks import CameraTrack, LandmarkLog, Landmarks
from vislam2tag.quality.evaluation.truth import Truth

RATE_HZ = 20.0
CORNERS = np.array((0, 42, 42 + 18j, 0 + 18j))
SEEN_M, SEEN_RAD = 3.0, 1.0
"""Farthest landmarks that are sighted, and most that they may be aside of the view."""
LOST_S = (2.0, 5.0)
START_NS = 10**12


@dataclass(frozen=True)
class Phone:
    """Noise of a tracker, and its faults a minute."""

    heading_rad: float
    """Per square root of a metre, as are the drifts below."""
    position_m: float
    scale_sigma: float
    visit_m: float
    """Error of a visit, per axis at 1 m."""
    jitter_m: float
    updates: float = 0.0
    jumps: float = 0.0
    losses: float = 0.0
    loops: float = 0.0
    fault_m: float = 0.4

    def times(self, factor: float) -> Phone:
        """A noisier phone with the same faults."""
        names = ("heading_rad", "position_m", "scale_sigma", "visit_m", "jitter_m")
        return replace(self, **{name: factor * getattr(self, name) for name in names})


PHONES = {
    "good": Phone(0.0005, 0.004, 0.004, 0.03, 0.003),
    "default": Phone(0.0015, 0.014, 0.01, 0.12, 0.005, updates=0.5, jumps=0.2, losses=0.2, loops=0.3),
    "severe": Phone(0.003, 0.03, 0.02, 0.25, 0.01, updates=1.0, jumps=0.7, losses=0.5, loops=0.7, fault_m=0.8),
}


def survey_walks(
    seed: int, phone: str, walks: int = 6, landmarks: int = 12, survey_m: float = 0.02, seconds: float = 180.0
) -> Iterator[Walk]:
    """The walks of one device past the same landmarks."""
    rng = np.random.default_rng((seed, 77))
    perimeter = np.abs(np.diff(np.append(CORNERS, CORNERS[0]))).sum()
    on_way = (np.arange(landmarks) + rng.uniform(0.2, 0.8, landmarks)) * perimeter / landmarks
    place, course = _on_loop(on_way)
    place = place + course * 1j * rng.choice((-0.9, 0.9), landmarks)
    off_m = rng.normal(0, survey_m, (landmarks, 2))
    ids = tuple(str(number + 1) for number in range(landmarks))
    surveyed = surveyed_at(ids, np.column_stack((place.real, place.imag)) + off_m, max(survey_m, 0.005))
    phone_noise = PHONES[phone].times(float(np.exp(rng.normal(0, 0.3))))
    for number in range(walks):
        own = phone_noise.times(float(np.exp(rng.normal(0, 0.25))))
        yield _walk(f"{seed}-{number}", own, place, on_way, surveyed, seconds, rng)


def _on_loop(way_m: FloatArray) -> tuple[ComplexArray, ComplexArray]:
    """Places and courses (n,) at distances (n,) along the loop of corridors."""
    ends = np.append(CORNERS, CORNERS[0])
    sides = np.diff(ends)
    until = np.concatenate(([0.0], np.cumsum(np.abs(sides))))
    way_m = np.mod(way_m, until[-1])
    side = np.clip(np.searchsorted(until, way_m, side="right") - 1, 0, len(sides) - 1)
    course = sides[side] / np.abs(sides[side])
    place = np.asarray(ends[side] + course * (way_m - until[side]), dtype=np.complex128)
    return place, np.asarray(course, dtype=np.complex128)


def _walked(on_way: FloatArray, frames: int, rng: np.random.Generator) -> tuple[ComplexArray, FloatArray]:
    """True places and courses (n,) of a walk along the corridors, which turns back now and then."""
    speed, way, direction, wait = rng.uniform(0.9, 1.4), rng.uniform(0, 100), rng.choice((-1, 1)), 0
    ways, signs, next_turn = np.empty(frames), np.empty(frames), rng.uniform(25, 70)
    passed: dict[int, float] = {}
    for frame in range(frames):
        ways[frame], signs[frame] = way, direction
        if wait > 0:
            wait -= 1
            continue
        way += direction * speed / RATE_HZ
        if frame / RATE_HZ > next_turn:
            direction, next_turn = -direction, next_turn + rng.uniform(25, 70)
        apart = np.abs((on_way - way + 60) % 120 - 60)
        near = int(apart.argmin())
        if apart[near] < 0.5 and frame / RATE_HZ - passed.get(near, -1e9) > 10:
            passed[near] = frame / RATE_HZ
            wait = int(rng.uniform(0, 3) * RATE_HZ) if rng.uniform() < 0.5 else 0
    place, along = _on_loop(ways)
    smooth = np.hanning(11) / np.hanning(11).sum()
    sway = 0.25 * np.sin(np.cumsum(rng.normal(0, 0.05, frames)))
    place = place + along * 1j * sway
    padded = np.concatenate((np.full(5, place[0]), place, np.full(5, place[-1])))
    course = np.unwrap(np.angle(along * signs))
    padded_course = np.concatenate((np.full(5, course[0]), course, np.full(5, course[-1])))
    return np.convolve(padded, smooth, "valid"), np.convolve(padded_course, smooth, "valid")


def _walk(
    name: str,
    phone: Phone,
    landmark: ComplexArray,
    on_way: FloatArray,
    surveyed: Landmarks,
    seconds: float,
    rng: np.random.Generator,
) -> Walk:
    frames = round(seconds * RATE_HZ)
    place, course = _walked(on_way, frames, rng)
    time_ns = START_NS + np.round(np.arange(frames) / RATE_HZ * 1e9).astype(np.int64)
    step, length = np.diff(place), np.abs(np.diff(place)) + 0.02 / RATE_HZ
    turn = rng.uniform(0, 2 * np.pi) + np.concatenate(
        ([0.0], np.cumsum(phone.heading_rad * np.sqrt(length) * rng.standard_normal(frames - 1)))
    )
    factor = (1 + phone.scale_sigma * rng.standard_normal()) * np.exp(1j * turn)
    slip = phone.position_m * np.sqrt(length) * (rng.standard_normal((frames - 1, 2)) @ (1, 1j))
    logged = np.concatenate(([0j], np.cumsum(step * factor[:-1] + slip)))
    shift, lost = np.zeros(frames, dtype=np.complex128), np.zeros(frames, dtype=np.bool_)

    def moments(rate: float) -> list[int]:
        return sorted(rng.integers(100, frames - 100, rng.poisson(rate * seconds / 60)).tolist())

    drifted = np.zeros(frames, dtype=np.complex128)
    for at in moments(phone.jumps):
        shift[at:] += phone.fault_m * (rng.standard_normal(2) @ (1, 1j))
    for at in moments(phone.loops):
        ramp = np.clip((np.arange(frames) - at) / RATE_HZ, 0, 1)
        drifted += ramp * phone.fault_m * 0.4 * (rng.standard_normal(2) @ (1, 1j))
    for at in moments(phone.losses):
        until = min(at + int(rng.uniform(*LOST_S) * RATE_HZ), frames - 1)
        lost[at:until] = True
        shift[until:] += phone.fault_m * (rng.standard_normal(2) @ (1, 1j))
    camera = logged + shift + drifted
    heading = course + turn
    seen = _in_view(place, course, landmark) & ~lost[:, None]
    world, known = _mapped(phone, place, landmark, camera, factor, seen, rng)
    whole, moved = np.ones(frames, dtype=np.complex128), np.zeros(frames, dtype=np.complex128)
    for at in moments(phone.updates):  # camera and landmarks together
        by, off = np.exp(1j * rng.normal(0, 0.05)), phone.fault_m * (rng.standard_normal(2) @ (1, 1j))
        whole[at:], moved[at:] = by * whole[at:], by * moved[at:] + off
    camera, world = whole * camera + moved, whole[:, None] * world + moved[:, None]
    held = np.maximum.accumulate(np.where(lost, 0, np.arange(frames)))
    camera, heading = camera[held], (heading + np.angle(whole))[held]
    return Walk(
        name,
        CameraTrack(
            time_ns, _acs(camera, 0.002 * rng.standard_normal(frames)), _yaw(heading), np.zeros(frames, np.int8)
        ),
        _log(surveyed.ids, camera, world, known, lost),
        surveyed,
        Truth(time_ns, np.column_stack((place.real, place.imag))),
        device=f"phone {name.split('-')[0]}",
    )


def _in_view(place: ComplexArray, course: FloatArray, landmark: ComplexArray) -> BoolArray:
    """Mask (n, m) of the landmarks before the camera and near."""
    to = landmark - place[:, None]
    aside = np.abs(np.angle(to * np.exp(-1j * course)[:, None]))
    return np.asarray((np.abs(to) < SEEN_M) & (aside < SEEN_RAD))


def _mapped(
    phone: Phone,
    place: ComplexArray,
    landmark: ComplexArray,
    camera: ComplexArray,
    factor: ComplexArray,
    seen: BoolArray,
    rng: np.random.Generator,
) -> tuple[ComplexArray, BoolArray]:
    """Logged places (n, m) of the landmarks, held where they were last seen, and which are known."""
    frames, count = seen.shape
    world, known = np.full((frames, count), np.nan + 0j), np.zeros((frames, count), dtype=np.bool_)
    for mark in range(count):
        rows = np.flatnonzero(seen[:, mark])
        if not len(rows):
            continue
        visit = np.concatenate(([0], np.cumsum(np.diff(rows) > 2 * RATE_HZ)))
        bias = phone.visit_m * (rng.standard_normal((visit[-1] + 1, 2)) @ (1, 1j))
        jitter = phone.jitter_m * (rng.standard_normal((len(rows), 2)) @ (1, 1j))
        to = landmark[mark] - place[rows]
        error = (bias[visit] * (0.5 + 0.5 * np.abs(to)) + jitter) * factor[rows] / np.abs(factor[rows])
        world[rows, mark] = camera[rows] + to * factor[rows] + error
        last = np.maximum.accumulate(np.where(seen[:, mark], np.arange(frames), -1))
        known[:, mark] = last >= 0
        world[known[:, mark], mark] = world[last[known[:, mark]], mark]
    return world, known


def _log(
    ids: tuple[str, ...], camera: ComplexArray, world: ComplexArray, known: BoolArray, lost: BoolArray
) -> LandmarkLog:
    first = np.where(known.any(axis=0), known.argmax(axis=0), len(known))
    order = np.argsort(first, kind="stable")[: int(known.any(axis=0).sum())]
    mark, frame = np.nonzero(known[:, order].T)
    gone = lost[frame]
    place = np.where(gone, camera[frame], world[frame, order[mark]])
    return LandmarkLog(
        ids=tuple(ids[one] for one in order.tolist()),
        landmark=mark.astype(np.int64),
        frame=frame.astype(np.int64),
        position_acs=_acs(place, np.zeros(len(place))),
        orientation_acs=np.tile((0.0, 0.0, 0.0, 1.0), (len(place), 1)),
        lost=gone,
    )


def _acs(plane: ComplexArray, height: FloatArray) -> FloatArray:
    """Positions (n, 3) with y up of places in the plane (x, -z)."""
    return np.column_stack((plane.real, height, -plane.imag))


def _yaw(heading: FloatArray) -> FloatArray:
    """Quaternions (n, 4) of a level camera that looks along ``heading``: its -z axis, with y up."""
    half = (heading - np.pi / 2) / 2
    zero = np.zeros_like(half)
    return np.column_stack((zero, np.sin(half), zero, np.cos(half)))
