"""Steps between frames that are not motion: jumps, tracking losses, excursions that are undone.

A jump of the tracker is visible as a step that does not fit the steps around it, in the plane and in height.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from vislam2tag.core.arrays import BoolArray, ComplexArray, FloatArray, IntArray, runs_of
from vislam2tag.core.tracks import CameraTrack, LandmarkLog

BEFORE, AFTER = (-3, -2, -1), (1, 2, 3)
"""Neighbouring steps whose median predicts a step."""
LEAST_SPREAD_M = 0.003
"""Predictions of steps are never more precise than this."""
IMPOSSIBLE = 10.0
"""A step that misses its prediction by more standard deviations than this, and by more than a person moves, is not
motion."""
FEW = 0.1
"""If fewer steps than this share miss their predictions at all, they do not determine the usual size."""
MEDIAN_SIGMAS = {1: 0.67, 2: 1.18}
"""Median length of a normal error of one or two dimensions, in standard deviations per axis."""


def predicted(step: FloatArray, dt: FloatArray, neighbours: Sequence[int] = BEFORE + AFTER) -> FloatArray:
    """Steps (n - 1,) predicted from the median rate of their neighbours; ``dt`` (n - 1,) their times, s."""
    if not len(step):
        return step
    reach = max(AFTER)
    rate = step / dt
    padded = np.concatenate((np.repeat(rate[:1], reach), rate, np.repeat(rate[-1:], reach)))
    return median_of([padded[reach + k : reach + k + len(step)] for k in neighbours]) * dt


def predicted_in_plane(step: ComplexArray, dt: FloatArray, neighbours: Sequence[int] = BEFORE + AFTER) -> ComplexArray:
    """The same for complex steps (n - 1,), metres."""
    x, y = (predicted(part, dt, neighbours) for part in (step.real, step.imag))
    return np.asarray(x + 1j * y)


def prediction_sigma_m(miss_m: FloatArray, dt: FloatArray, dimensions: int) -> FloatArray:
    """Standard deviation (n - 1,) per axis of the usual misfit of predictions; more in a longer step.

    ``miss_m`` (n - 1,) is the misfit of each, in the plane or (one dimension) in height.
    """
    moving = miss_m[miss_m > 0]
    usual = float(np.median(moving)) / MEDIAN_SIGMAS[dimensions] if moving.size > FEW * len(dt) else 0.0
    return np.asarray(np.maximum(usual, LEAST_SPREAD_M) * np.maximum(dt / np.median(dt), 1.0))


def implausible(miss_m: FloatArray, spread_m: FloatArray, dt: FloatArray, fastest_m_s: float) -> BoolArray:
    """Steps (n - 1,) that miss their predictions by more than chance (``spread_m``) and human motion explain."""
    return np.asarray(miss_m > np.maximum(IMPOSSIBLE * spread_m, fastest_m_s * dt))


def median_of(arrays: Sequence[FloatArray]) -> FloatArray:
    """Median (n,) over k arrays (n,), entry by entry; the mean of the two middle ones if k is even.

    Sorts by exchanging neighbours (odd-even transposition), k^2 / 2 exchanges of whole arrays. For k up to about ten
    this is many times faster than a general sort.
    """
    ranked = list(arrays)
    for start in range(len(ranked)):
        for low in range(start % 2, len(ranked) - 1, 2):
            first, second = ranked[low : low + 2]
            ranked[low : low + 2] = np.minimum(first, second), np.maximum(first, second)
    middle = len(ranked) // 2
    return ranked[middle] if len(ranked) % 2 else (ranked[middle - 1] + ranked[middle]) / 2


FROZEN_S = 0.3
"""A camera position that is exactly constant for longer is invalid."""
STANDING_M_S = 0.3
"""A camera with a lower mean speed during a tracking loss is frozen, with or without noise."""
FASTEST_M_S = 3.0
"""A longer jump over a loss means another map, because no person is faster."""
LEAST_JUMP_M = 0.3
"""... and a shorter step does not show that anything jumped at the loss."""
UNSEEN_M_S = 0.5
"""Movement of a person in a second while the camera is frozen (standard deviation per axis) ..."""
FOUND_M_S = 0.25
"""... and if the camera makes up for the path when tracking resumes."""
FROZEN_WALK_M = 6.0
FROZEN_WALK_M_S = 1.0
"""Possible distance walked while the camera was frozen: a constant, plus this in a second."""
FOUND_TURN_RAD = 0.03
NEW_MAP_TURN_RAD = 1.0
"""Standard deviation of the turn of a tracker's map over a loss, if it resumes in another map, metres away."""
FOUND_SIGMA_M = 0.1
"""Error of a tracker that continues through a loss."""


def lost_frames(camera: CameraTrack, log: LandmarkLog, frame: IntArray) -> BoolArray:
    """Mask (n,) of the usable frames in which the tracker was lost, according to the log if it contains this.

    Otherwise it was lost if landmarks are at the camera, or if none is logged any more.
    """
    if camera.state is not None:
        return np.asarray(~camera.state.tracking[frame])
    at_camera = np.zeros(len(camera.time_ns), dtype=bool)
    at_camera[log.frame[log.lost]] = True
    silent = np.ones(len(camera.time_ns), dtype=bool)
    silent[log.frame] = False
    silent[: log.frame.min(initial=len(silent))] = False
    return np.asarray((at_camera | silent)[frame])


def frozen_frames(camera: CameraTrack, frame: IntArray, time_s: FloatArray) -> BoolArray:
    """Mask (n,) of the usable frames in which the camera's position is constant for :data:`FROZEN_S`."""
    position = camera.position_acs[frame]
    frozen = np.zeros(len(frame), dtype=bool)
    for first, after in runs_of(np.all(position[1:] == position[:-1], axis=1)):
        if time_s[after] - time_s[first] > FROZEN_S:
            frozen[first : after + 1] = True
    return frozen


def steps_over_loss(step: ComplexArray, dt: FloatArray) -> tuple[ComplexArray, FloatArray]:
    """Steps (k,) over a loss and their variances (k,) per axis beyond the usual drift, m^2.

    A tracker that continues is trusted almost as usual. The path of a frozen camera, as far as the tracker makes up for
    it later, is spread evenly, with the variance of an unseen walker (less if the tracker makes up for it).
    """
    share = dt / dt.sum()
    jumped = np.abs(step) > np.maximum(FASTEST_M_S * dt, LEAST_JUMP_M)
    makes_good, jumped[-1] = jumped[-1], False  # there a frozen camera makes up for the path
    step = np.where(jumped, 0, step)
    if np.abs(step[:-1]).sum() >= STANDING_M_S * dt[:-1].sum() > 0:
        return step, FOUND_SIGMA_M**2 * share
    displacement = complex(step.sum())
    walkable = abs(displacement) < FASTEST_M_S * (dt.sum() + 1)
    free_m_s = FOUND_M_S if makes_good and walkable else UNSEEN_M_S
    return (displacement if walkable else 0j) * share, (free_m_s * dt.sum()) ** 2 * share


def loss_turn_rad(step: ComplexArray, dt: FloatArray) -> float:
    """Standard deviation of the turn of the map over a loss with these logged steps (k,)."""
    walkable = abs(complex(step.sum())) < FASTEST_M_S * (dt.sum() + 1)
    return FOUND_TURN_RAD if walkable else NEW_MAP_TURN_RAD


def walkable_m(frozen: BoolArray, dt: FloatArray) -> FloatArray:
    """Possible distance walked over each run of ``frozen`` steps (k,), metres, at its steps; 0 elsewhere."""
    length_m = np.zeros(len(dt))
    for start, stop in runs_of(frozen):
        length_m[start:stop] = FROZEN_WALK_M + FROZEN_WALK_M_S * dt[start:stop].sum()
    return length_m


BACK_M = 0.1
BACK_RAD = 0.2
"""A jump back misses the jump away by this share and, because of turns, by this share of the path between."""
FAR = 3.0
"""Only jumps larger than this many times that value count, so that two of them do not match by chance."""
TURN_SIGMA_RAD = 0.1
PLACE_SIGMA_M = 0.1
"""Movement of the tracker's frame during an excursion."""


def find_excursions(
    jump: ComplexArray, alone: BoolArray, unknown: BoolArray, length_m: FloatArray
) -> list[tuple[int, int, complex]]:
    """Find jumps of the camera ``alone`` (n - 1,) that undo earlier ones, but not across ``unknown`` steps.

    ``jump`` (n - 1,) is each step's part beyond motion, in the continuous frame; ``length_m`` (n - 1,) the lengths of
    the steps without it. Returns for each excursion the steps away and back, and the remaining difference, complex
    metres.
    """
    along_m = np.concatenate(([0.0], np.cumsum(length_m)))
    lost = np.cumsum(unknown)
    found: list[tuple[int, int, complex]] = []
    waiting: list[int] = []
    for back in np.flatnonzero(alone).tolist():
        waiting.append(back)
        for number in range(len(waiting) - 2, -1, -1):
            away, jumps = waiting[number], jump[waiting[number:]]
            if lost[back] > lost[away]:
                break
            missing = complex(jumps.sum())
            limit_m = BACK_M + BACK_RAD * float(along_m[back] - along_m[away])
            if abs(missing) < limit_m and np.abs(jumps).min() > FAR * limit_m:
                found.append((away, back, missing))
                waiting.clear()
                break
    return found


def returned(missing: complex, step: ComplexArray) -> tuple[ComplexArray, FloatArray]:
    """Steps (k,) of an excursion, complex metres, with the ``missing`` part, so that they end at the later log.

    Also the variance (k,), m^2 per axis, of the frame after each step; zero after the last one.
    """
    length = np.abs(step)
    share = length / length.sum() if length.sum() > 0 else np.full(len(step), 1 / len(step))
    along = np.cumsum(length)
    from_ends = np.minimum(along, along[-1] - along)
    variance = PLACE_SIGMA_M**2 + (TURN_SIGMA_RAD * from_ends) ** 2
    variance[-1] = 0
    return step + missing * share, variance
