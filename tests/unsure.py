"""A strategy for tests: the paper's local mapping that knows how sure it is, and reports events and a contradiction."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, replace
from unittest import mock

import numpy as np

from vislam2tag.core.arrays import FloatArray
from vislam2tag.core.status import Contradiction, EventKind, TrackerEvent, has_position
from vislam2tag.core.tracks import CameraTrack, LandmarkLog, Landmarks, Trajectory
from vislam2tag.estimation.settings import MappingSettings
from vislam2tag.estimation.strategy import STRATEGIES, strategy_named

SURE_M, UNSURE_M = 0.1, 0.9
"""Sigma of the first and of the last frame; it grows evenly between."""
EVENTS = (TrackerEvent(EventKind.MAP_UPDATE, 600, 0.42, -0.1), TrackerEvent(EventKind.LOSS, 0, 2.5))
OFFSET_M = (0.3, -0.4)


@dataclass(frozen=True)
class Unsure:
    """Positions of ``local``, a sigma that grows with time, two events, and a contradiction of the first landmark."""

    settings: MappingSettings
    needs: str = "two landmarks"

    def map(self, camera: CameraTrack, log: LandmarkLog, landmarks: Landmarks) -> Trajectory:
        mapped = strategy_named("local", self.settings).map(camera, log, landmarks)
        contradiction = Contradiction(landmarks.ids[0], 0.5, 0.1, OFFSET_M, 3)
        return replace(
            mapped,
            covariance_bcs=_covariance(mapped),
            events=tuple(event for event in EVENTS if event.frame < len(mapped.time_ns)),
            contradictions=(contradiction,),
        )


def _covariance(mapped: Trajectory) -> FloatArray:
    sigma_m = np.linspace(SURE_M, UNSURE_M, len(mapped.time_ns))
    covariance = np.eye(2) * sigma_m[:, None, None] ** 2
    covariance[~has_position(mapped.status)] = np.nan
    return covariance


@contextmanager
def unsure_registered() -> Iterator[None]:
    """Make the strategy known as ``unsure`` (in this process only: one job)."""
    STRATEGIES.all()  # what is loaded meanwhile would be forgotten
    with mock.patch.dict(STRATEGIES._items, {"unsure": Unsure}):
        yield
