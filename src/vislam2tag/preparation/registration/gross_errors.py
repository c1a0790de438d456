"""Which measurement is wrong, and how: left out, interchanged with another, mistyped.

Every hypothesis is judged by the sum of squares that it leaves, plus what it costs to believe: leaving a measurement
out lets it be anything within :data:`RANGE_M` (Occam's factor), a certain other value is one of as many as could have
been. Hypotheses that are as good as the best cannot be told apart, and all are told.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from vislam2tag.core.arrays import FloatArray, IntArray
from vislam2tag.preparation.registration.least_squares import Adjusted, NoiseLevel

RANGE_M = 10.0
"""A wrong measurement may be off by so much."""
LEAST_TYPED_M = 0.09
"""Exchanged digits that change less would fit any small error."""
AMBIGUOUS = 6.0
"""Hypotheses whose scores differ by less (likelihoods by less than twentyfold) cannot be told apart."""


@dataclass(frozen=True)
class ValueChange:
    """Another value for one or two measurements: what they would have to have been."""

    text: str
    measurements: tuple[int, ...]
    rows: IntArray
    by: FloatArray
    """(k,) whitened change of the misclosures at ``rows``."""
    choices: int
    """How many such changes there are: one of so many fits by chance."""


@dataclass(frozen=True)
class Explanation:
    """What may be wrong: the measurements concerned, and what is said of it."""

    measurements: tuple[int, ...]
    text: str
    """Empty: a measurement is off, nothing more is known."""
    score: float


def explanations(
    adjusted: Adjusted,
    groups: Sequence[IntArray],
    sigma_m: FloatArray,
    noise: NoiseLevel,
    suspects: Sequence[int],
    changes: Sequence[ValueChange],
) -> list[Explanation]:
    """The best explanation of why the suspects do not fit, then those that are as good, best first.

    ``sigma_m`` (measurements,) says how exact each is. Of several for the same measurements the best is kept.
    """
    found = [_left_out(adjusted, groups[i], float(sigma_m[i]), i, noise) for i in suspects]
    found += [
        Explanation(
            change.measurements,
            change.text,
            adjusted.changed_square(change.rows, change.by) / noise.factor + 2 * math.log(change.choices),
        )
        for change in changes
    ]
    found.sort(key=lambda one: one.score)
    close: dict[tuple[int, ...], Explanation] = {}
    for one in found:
        if one.score < found[0].score + AMBIGUOUS:
            close.setdefault(one.measurements, one)
    return list(close.values())


def _left_out(adjusted: Adjusted, rows: IntArray, sigma_m: float, measurement: int, noise: NoiseLevel) -> Explanation:
    """The hypothesis that a measurement, ``rows`` (k,), is off by anything."""
    reduction, checks = adjusted.reduction_without(rows)
    usual_m = sigma_m * math.sqrt(2 * math.pi * noise.factor)
    cost = 2 * checks * math.log(max(RANGE_M / usual_m, math.e))
    return Explanation((measurement,), "", (adjusted.square - reduction) / noise.factor + cost)


def mistyped(value: float, decimals: int) -> list[tuple[float, str]]:
    """Values that become ``value`` by one slip of who types them, with what to say of each.

    Two neighbouring digits exchanged, the sign forgotten, the decimal mark one place off, one digit of the whole
    metres wrong (smaller digits would fit any small error).
    """
    text = f"0{abs(value):.{decimals}f}"  # 10.5 may have become 01.5
    sign = -1.0 if value < 0 else 1.0
    found = {-value: "sign", value * 10: "decimal mark", value / 10: "decimal mark"}
    digits = [i for i, char in enumerate(text) if char.isdigit()]
    for one, other in itertools.pairwise(digits):
        swapped = list(text)
        swapped[one], swapped[other] = swapped[other], swapped[one]
        found.setdefault(sign * float("".join(swapped)), "digits exchanged")
    for place in digits[1 : len(digits) - decimals]:
        for digit in "0123456789":
            found.setdefault(sign * float(text[:place] + digit + text[place + 1 :]), "one digit wrong")
    return [(other, what) for other, what in found.items() if abs(other - value) >= LEAST_TYPED_M]


def listed(names: Sequence[str]) -> str:
    """Name things in a sentence."""
    return names[0] if len(names) == 1 else f"{', '.join(names[:-1])} and {names[-1]}"


def whitened(change: Sequence[complex], sigma_m: Sequence[float]) -> FloatArray:
    """Changes of the misclosures (2k,) of points in the plane."""
    values = np.array(change, dtype=np.complex128) / np.array(sigma_m)
    return np.column_stack((values.real, values.imag)).ravel()
