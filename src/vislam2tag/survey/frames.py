"""Floors of one site whose frames differ: ``site_T_bcs`` of each says how."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from vislam2tag.core.similarity import Similarity2
from vislam2tag.core.tracks import Landmarks
from vislam2tag.survey.frame_change import FrameChange
from vislam2tag.survey.model import Site


def changes_from(site: Site, own: int) -> dict[int, FrameChange]:
    """From the BCS of floor ``own`` to that of each floor; none where all floors share one frame."""
    frames = {floor.number: floor.site_T_bcs for floor in site.floors}
    if len(set(frames.values())) < 2:
        return {}
    return {number: FrameChange.of(number, frame.inverse.compose(frames[own])) for number, frame in frames.items()}


def in_frame_of(landmarks: Landmarks, site: Site, own: int) -> Landmarks:
    """Turn landmarks of all floors into the BCS of floor ``own``, in which a walk that passed them is mapped."""
    changes = changes_from(site, own)
    if not changes:
        return landmarks
    position, covariance = landmarks.position_bcs.copy(), landmarks.covariance_bcs.copy()
    heading = landmarks.heading_rad.copy()
    for number, change in changes.items():
        own_T_other = change.new_T_old.inverse
        rows = np.flatnonzero(landmarks.floor == number)
        surveyed = rows[landmarks.surveyed[rows]]
        position[surveyed] = own_T_other @ position[surveyed]
        turn = _matrix(own_T_other)
        covariance[surveyed] = turn @ covariance[surveyed] @ turn.T
        heading[rows] += own_T_other.rotation_rad
    return replace(landmarks, position_bcs=position, covariance_bcs=covariance, heading_rad=heading)


def _matrix(similarity: Similarity2) -> np.ndarray[tuple[int, int], np.dtype[np.float64]]:
    a = similarity.a
    return np.array([[a.real, -a.imag], [a.imag, a.real]])
