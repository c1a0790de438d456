"""The landmarks in a session's pictures: a quick look at few of them, a close one around what it found."""

from __future__ import annotations

from collections import Counter, deque
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from vislam2tag.common.progress import Progress, silent
from vislam2tag.core.arrays import FloatArray, IntArray
from vislam2tag.sessions.apps import Pictures
from vislam2tag.sightings.detectors import Detector, Seen
from vislam2tag.sightings.pictures import Picture, in_order
from vislam2tag.sightings.placing import Placed, placed

QUICK_S = 0.4
"""Pictures of the quick look are so far apart: who walks by sees a landmark for a second and more."""
CLOSE_S = 0.6
"""Pictures this near to one that shows a landmark are looked at closely."""
GREATEST_SIGMA_M = 0.3
"""A sighting less sure than this, per axis, tells no more than where somebody stood."""


@dataclass(frozen=True)
class PictureSighting:
    """A landmark in one picture: ``time_ns`` of the pose that it was taken at."""

    landmark: str
    time_ns: int
    pose: Placed


@dataclass(frozen=True)
class Search:
    """What a search found: sightings in order of time, and how many corners fit no pose, or no sure one."""

    sightings: tuple[PictureSighting, ...]
    doubtful: int
    pictures: int
    """How many were there."""
    missing: int
    """Pictures that could not be unpacked, as where a video is cut off."""


def search(pictures: Pictures, detectors: Sequence[Detector], progress: Progress[int] = silent) -> Search:
    """Look for landmarks; ``progress`` counts the pictures that were passed.

    Those before a picture that shows a landmark are kept until they are too old to be looked at closely, so that no
    video is decoded twice. Raises SessionError where the pictures cannot be opened.
    """
    quick = set(_every(pictures.time_ns, QUICK_S).tolist())
    count, looked, doubtful = len(pictures.time_ns), 0, 0
    found = list[PictureSighting]()
    recent = deque[tuple[int, Picture]]()
    close_ns = round(CLOSE_S * 1e9)
    close_until_ns = -np.inf
    for number, picture in in_order(pictures):
        now_ns = int(pictures.time_ns[number])
        recent.append((number, picture))
        while now_ns - pictures.time_ns[recent[0][0]] > close_ns:
            recent.popleft()
        if number in quick and (grey := picture()) is not None:
            looked += 1
            if any(detector.find(grey) for detector in detectors):
                close_until_ns = now_ns + close_ns
        while recent and now_ns <= close_until_ns:
            seen, unsure = _closely(pictures, *recent.popleft(), detectors)
            found += seen
            doubtful += unsure
        progress(number + 1, count)
    return Search(tuple(found), doubtful, count, len(quick) - looked)


def _closely(
    pictures: Pictures, number: int, picture: Picture, detectors: Sequence[Detector]
) -> tuple[list[PictureSighting], int]:
    """The sure sightings in one picture, and how many are doubtful."""
    grey = picture()
    if grey is None:
        return [], 0
    sure, unsure = surest([detector.find(grey) for detector in detectors], pictures.lens_px[number])
    time_ns = int(pictures.time_ns[number])
    return [PictureSighting(name, time_ns, pose) for name, pose in sure.items()], unsure


def surest(seen: Sequence[Sequence[Seen]], lens_px: FloatArray) -> tuple[dict[str, Placed], int]:
    """Pose of each landmark in one picture, by what each detector saw, and how many sightings are doubtful.

    Of several detectors (a sheet's picture, its tag) the surest counts. A landmark that one detector sees at two places
    hangs twice: nobody knows which one it is, and neither counts.
    """
    sure: dict[str, Placed] = {}
    doubtful = 0
    for of_one in seen:
        count = Counter(each.landmark for each in of_one)
        for each in of_one:
            pose = placed(each, lens_px) if count[each.landmark] == 1 else None
            if pose is None or not pose.sigma_m <= GREATEST_SIGMA_M:
                doubtful += 1
            elif each.landmark not in sure or pose.sigma_m < sure[each.landmark].sigma_m:
                sure[each.landmark] = pose
    return sure, doubtful


def _every(time_ns: IntArray, step_s: float) -> IntArray:
    """Numbers of the pictures that are the first in each step of time."""
    if not len(time_ns):
        return np.empty(0, dtype=np.int64)
    step = (time_ns - time_ns[0]) // int(step_s * 1e9)
    return np.flatnonzero(np.diff(step, prepend=-1) > 0)
