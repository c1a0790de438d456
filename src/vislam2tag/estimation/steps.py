"""Steps from frame to frame that are no motion: jumps, losses of tracking, excursions that are undone.

A tracker that jumps shows itself by a step that does not fit the steps about it, in the plane as in height.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from vislam2tag.core.arrays import BoolArray, ComplexArray, FloatArray, IntArray, runs_of
from vislam2tag.core.tracks import CameraTrack, LandmarkLog

BEFORE, AFTER = (-3, -2, -1), (1, 2, 3)
"""Neighbouring steps whose median predicts a step."""
LEAST_SPREAD_M = 0.003
"""Predictions of steps are not trusted better than this."""
IMPOSSIBLE = 10.0
"""A step that misses its prediction by more than this many standard deviations, and by more than anyone moves, is no
motion."""
FEW = 0.1
"""Where fewer steps than this share miss their predictions at all, those that do are no measure of the usual."""
MEDIAN_SIGMAS = {1: 0.67, 2: 1.18}
"""Median length of a normal error of one or two dimensions, in standard deviations per axis."""


def predicted(step: FloatArray, dt: FloatArray, neighbours: Sequence[int] = BEFORE + AFTER) -> FloatArray:
    """Steps (n - 1,) that the median rate of their neighbours leads to expect; ``dt`` (n - 1,) their times, s."""
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
    """Standard deviation (n - 1,) per axis of how far steps usually miss their predictions; more in a longer step.

    ``miss_m`` (n - 1,) is how far each does, in the plane or (one dimension) in height.
    """
    moving = miss_m[miss_m > 0]
    usual = float(np.median(moving)) / MEDIAN_SIGMAS[dimensions] if moving.size > FEW * len(dt) else 0.0
    return np.asarray(np.maximum(usual, LEAST_SPREAD_M) * np.maximum(dt / np.median(dt), 1.0))


def implausible(miss_m: FloatArray, spread_m: FloatArray, dt: FloatArray, fastest_m_s: float) -> BoolArray:
    """Steps (n - 1,) that miss their predictions by more than chance (``spread_m``) and anyone's motion explain."""
    return np.asarray(miss_m > np.maximum(IMPOSSIBLE * spread_m, fastest_m_s * dt))


def median_of(arrays: Sequence[FloatArray]) -> FloatArray:
    """Median (n,) over k arrays (n,), entry by entry; the mean of the two middle ones where k is even.

    Sorts by exchanging neighbours (odd-even transposition), k^2 / 2 exchanges of whole arrays: for k up to ten or so
    many times quicker than in general.
    """
    ranked = list(arrays)
    for start in range(len(ranked)):
        for low in range(start % 2, len(ranked) - 1, 2):
            first, second = ranked[low : low + 2]
            ranked[low : low + 2] = np.minimum(first, second), np.maximum(first, second)
    middle = len(ranked) // 2
    return ranked[middle] if len(ranked) % 2 else (ranked[middle - 1] + ranked[middle]) / 2


FROZEN_S = 0.3
"""A camera position that stays the same to the last bit for longer is no position."""
STANDING_M_S = 0.3
"""A camera that moves less than this on average while tracking is lost is frozen, noise or not."""
FASTEST_M_S = 3.0
"""No one walks faster: a longer jump over a loss is another map, not the way walked meanwhile."""
LEAST_JUMP_M = 0.3
"""... nor does a step shorter than this show that anything jumped as tracking was lost."""
UNSEEN_M_S = 0.5
"""Someone who walks while the camera is frozen gets elsewhere by this a second (standard deviation per axis) ..."""
FOUND_M_S = 0.25
"""... and by this where the camera makes good for the way as it is found again."""
FROZEN_WALK_M = 6.0
FROZEN_WALK_M_S = 1.0
"""Someone may have walked this far while the camera was frozen, and this much farther a second."""
FOUND_TURN_RAD = 0.03
NEW_MAP_TURN_RAD = 1.0
"""How far a tracker's map may have turned over a loss; and where it has come out in another map, metres away."""
FOUND_SIGMA_M = 0.1
"""How far off a tracker may be that goes on through a loss."""


def lost_frames(camera: CameraTrack, log: LandmarkLog, frame: IntArray) -> BoolArray:
    """Mask (n,) of the usable frames in which the tracker was lost, by its own word where the log has it.

    Otherwise it was where landmarks are at the camera, or none is logged any more.
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
    """Mask (n,) of the usable frames in which the camera's position stays the same for :data:`FROZEN_S`."""
    position = camera.position_acs[frame]
    frozen = np.zeros(len(frame), dtype=bool)
    for first, after in runs_of(np.all(position[1:] == position[:-1], axis=1)):
        if time_s[after] - time_s[first] > FROZEN_S:
            frozen[first : after + 1] = True
    return frozen


def steps_over_loss(step: ComplexArray, dt: FloatArray) -> tuple[ComplexArray, FloatArray]:
    """Steps (k,) over a loss and their variances (k,) per axis beyond the usual drift, m^2.

    A tracker that goes on meanwhile is believed nearly as ever. A frozen camera's way, as far as the tracker says when
    it finds itself again, is spread evenly, with the freedom of someone who walks unseen: less where it does.
    """
    share = dt / dt.sum()
    jumped = np.abs(step) > np.maximum(FASTEST_M_S * dt, LEAST_JUMP_M)
    makes_good, jumped[-1] = jumped[-1], False  # there a frozen camera makes good for the way
    step = np.where(jumped, 0, step)
    if np.abs(step[:-1]).sum() >= STANDING_M_S * dt[:-1].sum() > 0:
        return step, FOUND_SIGMA_M**2 * share
    displacement = complex(step.sum())
    walkable = abs(displacement) < FASTEST_M_S * (dt.sum() + 1)
    free_m_s = FOUND_M_S if makes_good and walkable else UNSEEN_M_S
    return (displacement if walkable else 0j) * share, (free_m_s * dt.sum()) ** 2 * share


def loss_turn_rad(step: ComplexArray, dt: FloatArray) -> float:
    """Standard deviation of how far the map has turned over a loss with these steps (k,), as logged."""
    walkable = abs(complex(step.sum())) < FASTEST_M_S * (dt.sum() + 1)
    return FOUND_TURN_RAD if walkable else NEW_MAP_TURN_RAD


def walkable_m(frozen: BoolArray, dt: FloatArray) -> FloatArray:
    """How far someone may have walked over each run of ``frozen`` steps (k,), metres, at its steps; 0 elsewhere."""
    length_m = np.zeros(len(dt))
    for start, stop in runs_of(frozen):
        length_m[start:stop] = FROZEN_WALK_M + FROZEN_WALK_M_S * dt[start:stop].sum()
    return length_m


BACK_M = 0.1
BACK_RAD = 0.2
"""A jump back misses the jump away by this and, as the tracker may have turned, by this much of the way between."""
FAR = 3.0
"""Only jumps this many times greater than that count: two of them do not fit one another by chance."""
TURN_SIGMA_RAD = 0.1
PLACE_SIGMA_M = 0.1
"""How far the tracker may have turned and moved while it was away."""


def find_excursions(
    jump: ComplexArray, alone: BoolArray, unknown: BoolArray, length_m: FloatArray
) -> list[tuple[int, int, complex]]:
    """Find jumps of the camera ``alone`` (n - 1,) that undo those before; none across steps that are ``unknown``.

    ``jump`` (n - 1,) is what each step has beyond motion, in the continuous frame; ``length_m`` (n - 1,) lengths of the
    steps without it. Of each excursion: the steps away and back, and what their jumps do not undo, complex metres.
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
    """Steps (k,) of an excursion, complex metres, with what was ``missing``: they lead where the log is afterwards.

    Also the variance (k,), m^2 per axis, of the frame after each step: nothing after the last one.
    """
    length = np.abs(step)
    share = length / length.sum() if length.sum() > 0 else np.full(len(step), 1 / len(step))
    along = np.cumsum(length)
    from_ends = np.minimum(along, along[-1] - along)
    variance = PLACE_SIGMA_M**2 + (TURN_SIGMA_RAD * from_ends) ** 2
    variance[-1] = 0
    return step + missing * share, variance
