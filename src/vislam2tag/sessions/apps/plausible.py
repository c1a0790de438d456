"""Whether poses can be those of somebody walking: in metres and seconds, level, the camera looking ahead."""

from __future__ import annotations

import numpy as np

from vislam2tag.common.findings import Finding, Severity
from vislam2tag.core.arrays import FloatArray
from vislam2tag.core.orientation import rotated
from vislam2tag.core.tracks import CameraTrack

SHORTEST_M, LONGEST_S = 5.0, 2.0
"""Of shorter ways nothing is said; poses farther apart in time are not neighbours."""
FASTEST_M_S, SLOWEST_M_S = 15.0, 0.01
"""Medians of walks lie far within: a factor of a thousand, as between metres and millimetres, leads out."""
UPRIGHT = 3.0
"""Somebody who walks on floors goes farther in each level direction than up, but in a corridor; so many times as far
up as along the lesser of both is the way of a frame whose axes are others."""
BACKWARDS = -0.5
"""Mean cosine between where the camera looks and where it goes: nobody walks backwards all the way."""


def pose_findings(camera: CameraTrack, file: str) -> list[Finding]:
    """Report poses in other units, or in axes that are not those that the file should have."""
    usable = camera.usable
    time_s, position = camera.time_ns[usable] * 1e-9, camera.position_acs[usable]
    if len(time_s) < 3:
        return []
    step, step_s = np.diff(position, axis=0), np.diff(time_s)
    near = (step_s > 0) & (step_s <= LONGEST_S)
    length = np.linalg.norm(step, axis=1)
    findings = []
    speed = _usual_speed(length, step_s)
    if speed > FASTEST_M_S or (length.sum() > SHORTEST_M and speed < SLOWEST_M_S):
        message = (
            f"the camera moves at {speed:.3g} m/s: lengths are not in metres, or times not in seconds, as this format "
            "has them; convert the file"
        )
        return [Finding(kind="unknown_unit", file=file, count=1, message=message, severity=Severity.ERROR)]
    if not near.any() or length[near].sum() < SHORTEST_M:
        return []
    extent = np.ptp(position, axis=0)
    if extent[1] > SHORTEST_M and extent[1] > UPRIGHT * min(extent[0], extent[2]):
        message = (
            f"the way goes {extent[1]:.0f} m up and down, and stays within {min(extent[0], extent[2]):.1f} m along a "
            "level axis: unless it was up a staircase, another axis points up than this format says (in poses.toml: "
            "frame)"
        )
        findings.append(Finding(kind="pose_convention", file=file, count=1, message=message))
    cosine = _looks_ahead(camera.orientation_acs[usable][:-1][near], step[near])
    if cosine < BACKWARDS:
        message = (
            f"the camera looks back all the way (cosine {cosine:.2f}): its axes are others than this format says "
            "(in poses.toml: camera); landmarks would be placed behind it"
        )
        findings.append(Finding(kind="pose_convention", file=file, count=1, message=message))
    return findings


def _usual_speed(length: FloatArray, step_s: FloatArray) -> float:
    """Median speed over the steps that moved, m/s; 1 where none did."""
    moved = (length > 0) & (step_s > 0)
    return float(np.median(length[moved] / step_s[moved])) if moved.any() else 1.0


def _looks_ahead(orientation: FloatArray, step: FloatArray) -> float:
    """Mean cosine between the level directions of look and way, each step weighed by its length."""
    look = rotated(orientation, np.tile((0.0, 0.0, -1.0), (len(step), 1)))[:, (0, 2)]
    way = step[:, (0, 2)]
    size = np.linalg.norm(look, axis=1) * np.linalg.norm(way, axis=1)
    known = size > 0
    weight = np.linalg.norm(way, axis=1)[known]
    return float(np.sum(np.sum(look * way, axis=1)[known] / size[known] * weight) / max(weight.sum(), 1e-9))
