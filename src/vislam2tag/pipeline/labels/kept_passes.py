"""What is kept of a session so that a run can tell the survey's faults without reading it again."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

import numpy as np

from vislam2tag.common.errors import SessionError
from vislam2tag.core.arrays import ComplexArray
from vislam2tag.core.similarity import as_complex, as_points
from vislam2tag.estimation.drift import STATES
from vislam2tag.estimation.observations import WalkObservations
from vislam2tag.labeling.results import PassesRecord
from vislam2tag.quality.diagnosis.alignment import WalkPasses
from vislam2tag.sessions.id_findings import walk_id_shift
from vislam2tag.sessions.prepared import PreparedSession
from vislam2tag.site.model import SessionKey

Places = dict[str, tuple[int, complex]]
"""Floor and position of each surveyed landmark that a session may use, complex metres."""
_DIGITS = 6
"""Of numbers kept."""


def passes_record(prepared: PreparedSession, range_m: float) -> PassesRecord | None:
    """Reduce a session to its passes, sightings within ``range_m``; None where it has too few usable frames."""
    try:
        session = prepared.longest_section().session
    except SessionError:
        return None
    walk = WalkPasses.of(session.key, WalkObservations.of(session.camera, session.landmarks, range_m))
    return PassesRecord(
        landmark=list(walk.landmark),
        time_s=_rounded(walk.time_s.tolist()),
        camera=_points(walk.camera),
        offset=_points(walk.offset),
        sighting_m2=_rounded(walk.sighting_m2.tolist()),
        drift=[_rounded(row) for row in walk.drift.reshape(-1, STATES**2).tolist()],
        places={name: (floor, at.real, at.imag) for name, (floor, at) in places_of(prepared).items()},
        id_shift=walk_id_shift(session.camera, session.landmarks, prepared.landmarks),
    )


def places_of(prepared: PreparedSession) -> Places:
    """Surveyed landmarks that a session may use, those of floors with other frames left out."""
    landmarks, own = prepared.landmarks, prepared.session.key.floor
    one_frame, surveyed = not prepared.task.frames, landmarks.surveyed
    return {
        name: (int(landmarks.floor[i]), complex(*landmarks.position_bcs[i]))
        for i, name in enumerate(landmarks.ids)
        if surveyed[i] and (one_frame or int(landmarks.floor[i]) == own)
    }


def kept_walk(key: SessionKey, record: PassesRecord) -> tuple[WalkPasses, Places]:
    """The passes and places of a session from what was kept of it."""
    walk = WalkPasses(
        key=key,
        landmark=tuple(record.landmark),
        time_s=np.array(record.time_s, dtype=np.float64),
        camera=_complex(record.camera),
        offset=_complex(record.offset),
        sighting_m2=np.array(record.sighting_m2, dtype=np.float64),
        drift=np.array(record.drift, dtype=np.float64).reshape(-1, STATES, STATES),
        id_shift=record.id_shift,
    )
    return walk, {name: (floor, complex(x, y)) for name, (floor, x, y) in record.places.items()}


def _points(values: ComplexArray) -> list[tuple[float, float]]:
    return [(round(x, 4), round(y, 4)) for x, y in as_points(values).tolist()]


def _complex(points: Sequence[tuple[float, float]]) -> ComplexArray:
    return as_complex(np.array(points, dtype=np.float64).reshape(-1, 2))


def _rounded(values: Iterable[float]) -> list[float]:
    return [float(f"{value:.{_DIGITS}g}") for value in values]
