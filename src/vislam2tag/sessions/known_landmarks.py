"""Whether the landmarks a session saw are in the site's landmark file."""

from __future__ import annotations

from vislam2tag.core.tracks import LandmarkLog, Landmarks
from vislam2tag.findings import Finding


def landmarks_without_position(log: LandmarkLog, landmarks: Landmarks) -> list[Finding]:
    """Report landmarks that were seen but have no surveyed position (``landmarks``: those of the session's floor)."""
    missing = [name for name in log.ids if name not in landmarks.surveyed_ids]
    if not missing:
        return []
    message = (
        f"landmarks {', '.join(missing)} were seen but have no surveyed position; they are not used: add them to "
        "marker_dict.csv"
    )
    return [Finding(kind="landmark_without_position", file="", count=len(missing), message=message)]
