"""A session without poses checked against itself: each known position is predicted from the others."""

from __future__ import annotations

from typing import Any

import numpy as np

from vislam2tag.common.errors import SessionError
from vislam2tag.core.similarity import as_complex
from vislam2tag.estimation.dead_reckoning.walk import LeftOut as LeftOutFixes
from vislam2tag.estimation.dead_reckoning.walk import ReckonedWalk
from vislam2tag.estimation.strategies.dead_reckoning import DeadReckoning
from vislam2tag.labeling.settings import ProcessSettings
from vislam2tag.quality.self_check import LeftOut, estimate_accuracy
from vislam2tag.quality.self_check_record import DoubtfulFix, LeftOutMark
from vislam2tag.sessions.prepared import PreparedSession


def checked_by_fixes(prepared: PreparedSession, settings: ProcessSettings) -> dict[str, Any]:
    """Return the session's numbers under their names in its record; raises SessionError where it cannot be mapped."""
    walk, camera = reckoned(prepared, settings), prepared.session.camera
    time_s = np.asarray((camera.time_ns[camera.usable] - walk.sensed.signals.start_ns) * 1e-9, dtype=np.float64)
    covariance = walk.at(time_s)[1]
    sigma_m = np.sqrt(np.trace(covariance, axis1=1, axis2=2) / 2)
    labelled = sigma_m <= settings.labels.max_sigma_without_poses_m
    left_out = LeftOutFixes.of(walk)
    marks = _left_out(walk, left_out, prepared.session.key.floor)
    found = [LeftOut(mark.landmark, 1, np.array(mark.offset_m), mark.covariance_m2[0] * np.eye(2)) for mark in marks]
    details: dict[str, Any] = {
        "fixes": len(walk.names),
        "left_out": marks,
        "doubtful_fixes": doubtful_fixes(walk, left_out),
        "frames": len(sigma_m),
        "labelled": int(labelled.sum()),
    }
    if (estimate := estimate_accuracy(covariance[labelled], found)) is not None:
        details |= estimate.rounded()
    return details


def reckoned(prepared: PreparedSession, settings: ProcessSettings) -> ReckonedWalk:
    """Map a session without poses; raises SessionError where it cannot be."""
    strategy = DeadReckoning(settings.mapping.dead_reckoning, settings.mapping.heights)
    walk = strategy.reckoned(prepared.session.camera, prepared.landmarks)
    if walk is None:
        raise SessionError(f"{prepared.session.key}: could not be mapped: it needs {strategy.needs}")
    return walk


def doubtful_fixes(walk: ReckonedWalk, left_out: LeftOutFixes) -> list[DoubtfulFix]:
    """The fixes that the others contradict, in order of time."""
    return [
        DoubtfulFix(
            name=walk.names[fix],
            fix_m=_rounded(walk.ties.position[fix]),
            offset_m=_rounded(as_complex(left_out.error_m[fix]).item()),
            size_m=round(float(np.linalg.norm(left_out.error_m[fix])), 4),
            sigma_m=round(float(left_out.sigma_m[fix]), 4),
        )
        for fix in np.flatnonzero(left_out.doubtful).tolist()
    ]


def _rounded(place: complex) -> tuple[float, float]:
    """A place or an offset, x + iy, to a tenth of a millimetre."""
    return round(float(place.real), 4), round(float(place.imag), 4)


def _left_out(walk: ReckonedWalk, left_out: LeftOutFixes, floor: int) -> list[LeftOutMark]:
    """The fixes of which the others say something."""
    scatter_m2 = walk.fix_scatter_m**2
    return [
        LeftOutMark(
            floor=floor,
            landmark=walk.names[fix],
            passes=1,
            surveyed_m=_rounded(walk.ties.position[fix]),
            offset_m=_rounded(as_complex(left_out.error_m[fix]).item()),
            covariance_m2=(float(left_out.sigma_m[fix] ** 2), 0.0, float(left_out.sigma_m[fix] ** 2)),
            survey_covariance_m2=(float(scatter_m2[fix]), 0.0, float(scatter_m2[fix])),
        )
        for fix in np.flatnonzero(np.isfinite(left_out.sigma_m)).tolist()
    ]
