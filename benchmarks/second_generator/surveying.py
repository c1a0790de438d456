"""What the surveyor says of the sheets, and where they really hang at each frame."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from second_generator.floor import HungSheets
from second_generator.habits import Surveying
from second_generator.random_numbers import gross_error, normal_plane
from vislam2tag.core.arrays import ComplexArray, FloatArray
from vislam2tag.core.tracks import Landmarks

HEADING_SIGMA_RAD = 0.03
FEWEST_TO_SPOIL = 6


@dataclass(frozen=True)
class Surveyed:
    """A survey and the truth."""

    landmarks: Landmarks
    sheets: ComplexArray
    """(n, m) where each landmark's sheet hangs at each frame, BCS metres."""


def survey_sheets(hung: HungSheets, frames: int, habits: Surveying, rng: np.random.Generator) -> Surveyed:
    """Survey sheets (m,): some measured wrongly, moved during the walk, swapped, or not surveyed at all."""
    count = len(hung.place)
    told = hung.place + habits.sigma_m * normal_plane(rng, count)
    sheets = np.broadcast_to(hung.place, (frames, count)).copy()
    if count >= FEWEST_TO_SPOIL:
        _spoil(told, sheets, habits, rng)
    return Surveyed(_landmarks(told, hung.along_wall, habits, rng), sheets)


def _spoil(told: ComplexArray, sheets: ComplexArray, habits: Surveying, rng: np.random.Generator) -> None:
    """Put errors into what is told (m,) and into where sheets are (n, m); no sheet has two."""
    frames, count = sheets.shape
    wrong = np.flatnonzero(rng.random(count) < habits.mis_surveyed)[: count // 5].tolist()
    for sheet in wrong:
        told[sheet] += gross_error(rng)
    moved = np.flatnonzero(rng.random(count) < habits.moved)[: count // 6].tolist()
    for sheet in set(moved) - set(wrong):
        sheets[int(rng.uniform(0.2, 0.8) * frames) :, sheet] += gross_error(rng)
    if count >= 10 and rng.random() < 4 * habits.swapped:
        pair = rng.choice(count, 2, replace=False)
        if not {*wrong, *moved} & set(pair.tolist()):
            told[pair] = told[pair[::-1]]


def _landmarks(told: ComplexArray, along_wall: ComplexArray, habits: Surveying, rng: np.random.Generator) -> Landmarks:
    count = len(told)
    known = rng.random(count) >= habits.unsurveyed
    heading_known = known & habits.headings
    heading = np.angle(along_wall * np.exp(1j * HEADING_SIGMA_RAD * rng.standard_normal(count)))
    variance: FloatArray = np.where(known, habits.sigma_m**2, np.inf)
    covariance = np.zeros((count, 2, 2))
    covariance[:, 0, 0] = covariance[:, 1, 1] = variance
    return Landmarks(
        ids=tuple(str(number + 1) for number in rng.permutation(count)),
        floor=np.zeros(count, dtype=np.int64),
        position_bcs=np.where(known[:, None], np.column_stack((told.real, told.imag)), np.nan),
        covariance_bcs=covariance,
        z_m=np.full(count, np.nan),
        heading_rad=np.where(heading_known, heading, np.nan),
        heading_sigma_rad=np.where(heading_known, HEADING_SIGMA_RAD, np.nan),
    )
