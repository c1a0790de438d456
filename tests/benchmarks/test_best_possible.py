"""The floor under the errors: its drift is the simulator's, and it grows with what is not known."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from best_possible import Known, floor_m, mean_length, unit_noises

from vislam2tag.core.arrays import FloatArray
from vislam2tag.simulation.settings import TrackerSettings
from vislam2tag.simulation.tracking.dead_reckoning import CameraFrames, dead_reckon
from vislam2tag.simulation.tracking.sightings import Sightings

RATE_HZ = 10.0


def told(passes: list[tuple[int, int, int]], frames: int = 400) -> Known:
    """A walk round a bend at 1 m/s past two landmarks, which are seen in these runs: landmark, start, stop."""
    turn = np.linspace(0, 2.0, frames)
    path = (np.cumsum(np.exp(1j * turn)) / RATE_HZ).astype(np.complex128)
    nothing = np.zeros(frames)
    looking = np.column_stack((np.cos(turn), np.sin(turn), nothing))
    time_ns = np.arange(frames, dtype=np.int64)
    exposed = CameraFrames(
        time_ns, time_ns, path, nothing, np.zeros((frames, 4)), looking, nothing + 1, nothing > 0, nothing
    )
    seen = np.zeros((frames, 2), dtype=bool)
    sightings = Sightings(seen, seen + 0j, seen + 0.0, seen + 0.0, np.array(passes, dtype=np.int64).reshape(-1, 3))
    return Known(exposed, sightings, path[[50, 350]] + 0.5j, TrackerSettings(frame_rate_hz=RATE_HZ))


def test_drift_spreads_as_the_simulators_does() -> None:
    known = told([])
    at = np.arange(0, 400, 5)
    settings = known.settings.model_copy(update={"heading_drift_rad": 0.006, "scale_sigma": 0.02})
    place, scaled, turned = unit_noises(at, replace(known, settings=settings))
    drawn: list[FloatArray] = []
    for seed in range(600):
        walked = dead_reckon(known.frames, settings, np.random.default_rng(seed))
        start = np.angle(walked.factor[0])
        path = (walked.plane - walked.plane[0]) * np.exp(-1j * start)
        miss = path[at[-1]] - (known.frames.plane[at[-1]] - known.frames.plane[0])
        factor = walked.factor[at[-1]] * np.exp(-1j * start)
        drawn.append(np.array([miss.real, miss.imag, abs(factor) - 1, np.angle(factor)]))
    maps = np.vstack((place[-2:], scaled[-1:], turned[-1:]))
    free = [0, 80, 160]  # where the walk starts and how it is turned: not part of the drift
    stated = np.sqrt(np.sum(np.delete(maps, free, axis=1) ** 2, axis=1))
    np.testing.assert_allclose(np.std(drawn, axis=0), stated, rtol=0.1)


def test_more_sightings_lower_the_floor_and_both_landmarks_tell_between_them() -> None:
    few = floor_m(told([(0, 40, 60), (1, 340, 360)]), law=False)
    more = floor_m(told([(0, 40, 60), (0, 70, 80), (1, 340, 360)]), law=False)
    assert np.all(more < few + 1e-9)
    assert few[200] < few[50] < few[0]
    assert few[50] == pytest.approx(
        np.sqrt(np.pi / 2) * 0.19 * 0.75, rel=0.15
    )  # its own error, less what the other tells
    assert floor_m(told([(0, 20, 90), (1, 300, 390)]), law=True)[50] < few[50] / 2


def test_the_mean_length_of_normal_vectors() -> None:
    rng = np.random.default_rng(1)
    covariance = np.array([[[4.0, 1.5], [1.5, 1.0]], [[1.0, 0.0], [0.0, 1.0]]])
    drawn = [np.linalg.norm(rng.multivariate_normal((0, 0), one, 40_000), axis=1).mean() for one in covariance]
    np.testing.assert_allclose(mean_length(covariance), drawn, rtol=0.02)
