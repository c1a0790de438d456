"""The plane network, whatever gross errors the points have: rough frames of all stations, errors found and left out.

Two common points at a time say how one frame is in another; what most other common points agree with is taken
(exhaustive consensus, after Fischler and Bolles 1981). Frames are joined in the order of their agreement, so a station
without a known point of its own follows through the points that it shares with others.
"""

from __future__ import annotations

import itertools
from collections import Counter, defaultdict
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import partial

import numpy as np

from vislam2tag.common.errors import SurveyError
from vislam2tag.core.arrays import ComplexArray, IntArray
from vislam2tag.core.transforms import Similarity2
from vislam2tag.preparation.registration.least_squares import (
    PRIOR_FREEDOM,
    Explanation,
    NoiseLevel,
    SingularError,
    ValueChange,
    explanations,
    listed,
    mistyped,
    suspicious,
    whitened,
)
from vislam2tag.preparation.registration.names import PlaceByPoint, point_label
from vislam2tag.preparation.registration.network import KNOWN, Measurement, PlaneFit, adjust_plane

BUILDING = "the building"
"""Name of the frame of the known points."""
MOST_PAIRS = 3000
"""Pairs of common points tried, the furthest apart first."""
MOST_INTERCHANGED = 12
"""Common points among which interchanged names are tried; of more, the others are enough."""
LEAST_APART_M = 0.3
"""Two points closer than this do not determine a direction."""


@dataclass(frozen=True)
class Agreement:
    """How one frame is in another by two common points, and how many agree."""

    map: Similarity2
    agreeing: int
    common: int
    missed: float
    """Sum over common points of the squared distance, in units of the tolerance, at most 1 each."""


@dataclass(frozen=True)
class _Frame:
    names: tuple[str, ...]
    points: dict[str, complex]
    maps: dict[str, Similarity2]


def rough_frames(
    known: PlaceByPoint, stations: Mapping[str, PlaceByPoint], tolerance_m: float
) -> dict[str, Similarity2]:
    """For each station a map to the frame of the known points, good to the tolerance or so.

    Raises SurveyError, naming stations and points, where a station cannot be placed.
    """
    frames = [_Frame((BUILDING,), dict(known), {})]
    frames += [_Frame((name,), dict(points), {name: Similarity2.identity()}) for name, points in stations.items()]
    while len(frames) > 1:
        joins = _joins(frames, tolerance_m)
        if not joins:
            raise SurveyError(_why_no_join(frames, tolerance_m))
        agreement, onto, moved = max(joins, key=lambda join: (join[0].agreeing, -join[0].missed))
        _refuse_mirrored(frames[onto], frames[moved], agreement, tolerance_m)
        joined = _joined(frames[onto], frames[moved], agreement.map)
        frames = [joined if i == onto else one for i, one in enumerate(frames) if i != moved]
    return frames[0].maps


def _joins(frames: Sequence[_Frame], tolerance_m: float) -> list[tuple[Agreement, int, int]]:
    """How pairs of frames agree, each with the numbers of the one that stays and the one that is moved onto it."""
    pairs = itertools.combinations(range(len(frames)), 2)
    found = ((agree(frames[moved].points, frames[onto].points, tolerance_m), onto, moved) for onto, moved in pairs)
    return [(agreement, onto, moved) for agreement, onto, moved in found if agreement is not None]


def agree(
    source: PlaceByPoint, target: PlaceByPoint, tolerance_m: float, *, mirrored: bool = False
) -> Agreement | None:
    """The turn and shift from ``source`` to ``target`` with which most common points agree; None where no two do.

    Among few points it may take two interchanged names: of three points of which two are interchanged, only those two
    would agree, in a frame turned around.
    """
    common = [name for name in source if name in target]
    if len(common) < 2:
        return None
    p = np.array([source[name] for name in common])
    p, q = p.conj() if mirrored else p, np.array([target[name] for name in common])
    best = _best_agreement(p, q, tolerance_m)
    if len(common) > MOST_INTERCHANGED or (best is not None and best.agreeing == len(common)):
        return best
    for i, j in itertools.combinations(range(len(common)), 2):
        interchanged = q.copy()
        interchanged[[i, j]] = q[[j, i]]
        other = _best_agreement(p, interchanged, tolerance_m)
        if other is not None and other.agreeing >= 3 and (best is None or other.agreeing > best.agreeing):
            best = other
    return best


def _pairs(p: ComplexArray) -> tuple[IntArray, IntArray]:
    """Pairs (j,), (j,) of points (k,), the furthest apart first where there are many."""
    first, second = np.triu_indices(len(p), 1)
    if len(first) > MOST_PAIRS:
        far = np.argsort(-np.abs(p[second] - p[first]), kind="stable")[:MOST_PAIRS]
        first, second = first[far], second[far]
    return first, second


def _best_agreement(p: ComplexArray, q: ComplexArray, tolerance_m: float) -> Agreement | None:
    """Of all frames by two points of (k,) the one with least missed; ties go to the first."""
    first, second = _pairs(p)
    dp, dq = p[second] - p[first], q[second] - q[first]
    fits = np.minimum(np.abs(dp), np.abs(dq)) > LEAST_APART_M
    fits &= np.abs(np.abs(dp) - np.abs(dq)) < tolerance_m
    if not fits.any():
        return None
    turn = dq[fits] / dp[fits]
    turn /= np.abs(turn)
    shift = (q[first] + q[second])[fits] / 2 - turn * (p[first] + p[second])[fits] / 2
    square = np.abs(turn[:, None] * p + shift[:, None] - q) ** 2 / tolerance_m**2
    missed = np.minimum(square, 1).sum(axis=1)
    one = int(missed.argmin())
    agreeing = int((square[one] < 1).sum())
    return Agreement(Similarity2(complex(turn[one]), complex(shift[one])), agreeing, len(p), float(missed[one]))


def _joined(onto: _Frame, moved: _Frame, onto_T_moved: Similarity2) -> _Frame:
    points = dict(onto.points)
    for name, place in moved.points.items():
        points.setdefault(name, onto_T_moved.a * place + onto_T_moved.b)
    maps = onto.maps | {name: onto_T_moved.compose(one) for name, one in moved.maps.items()}
    return _Frame(onto.names + moved.names, points, maps)


def _refuse_mirrored(onto: _Frame, moved: _Frame, direct: Agreement, tolerance_m: float) -> None:
    """Raise SurveyError where points fit a mirrored frame much better: east and north were exchanged."""
    mirrored = agree(moved.points, onto.points, tolerance_m, mirrored=True)
    if mirrored is not None and mirrored.agreeing >= 3 and mirrored.agreeing > direct.agreeing:
        raise SurveyError(
            f"station {' and '.join(moved.names)} fits {' and '.join(onto.names)} better if mirrored "
            f"({mirrored.agreeing} of {mirrored.common} points instead of {direct.agreeing}): the columns of one are "
            "probably N, E rather than E, N. Name them with --columns, such as point,N,E,H, or correct the header"
        )


def _why_no_join(frames: Sequence[_Frame], tolerance_m: float) -> str:
    """Say why no further frame can be joined."""
    onto, moved = max(
        ((a, b) for i, a in enumerate(frames) for b in frames[i + 1 :]),
        key=lambda pair: len(pair[0].points.keys() & pair[1].points.keys()),
    )
    common = [name for name in moved.points if name in onto.points]
    there = " and ".join(onto.names)
    who = f"station {' and '.join(moved.names)}"
    if len(common) < 2:
        shares = f"only point {point_label(common[0])}" if common else "no point"
        return f"{who} shares {shares} with {there}, but its frame needs two: measure more known or common points"
    names = ", ".join(map(point_label, common))
    places = [np.array([frame.points[name] for name in common]) for frame in (moved, onto)]
    first, second = np.triu_indices(len(common), 1)
    apart = [np.abs(one[second] - one[first]) for one in places]
    if min(one.max() for one in apart) < LEAST_APART_M:
        return (
            f"{who} shares the points {names} with {there}, but they are at the same place: its frame needs two "
            "points well apart"
        )
    ratio = float(np.median(apart[1] / np.maximum(apart[0], 1e-9)))
    return (
        f"{who} shares the points {names} with {there}, but no two of them have the same distance in both (within "
        f"{tolerance_m:.2f} m); the distances in {there} are {ratio:.3f} times as long. Check for wrong names, feet "
        "instead of metres, and mistyped coordinates"
    )


def _interchanged(fit: PlaneFit, suspects: Sequence[int]) -> list[ValueChange]:
    """Two points of one station, or two known ones, whose names were interchanged, one of them suspect."""
    rows_of: dict[str, dict[str, list[int]]] = defaultdict(lambda: defaultdict(list))
    for i, measurement in enumerate(fit.measurements):
        rows_of[measurement.station][measurement.point].append(i)
    suspect = {(fit.measurements[i].station, fit.measurements[i].point) for i in suspects}
    suspect |= {(KNOWN, point) for _, point in suspect}
    pairs = [
        (station, one, other)
        for station in sorted(rows_of, key=lambda name: (name == KNOWN, name))
        for one, other in itertools.combinations(rows_of[station] if station == KNOWN else sorted(rows_of[station]), 2)
        if suspect & {(station, one), (station, other)}
    ]
    choices = Counter(station == KNOWN for station, _, _ in pairs)
    found = []
    for station, one, other in pairs:
        ours, others = rows_of[station][one], rows_of[station][other]
        here, there = (np.mean([fit.measurements[i].place for i in rows]) for rows in (ours, others))
        shift = complex(there - here)
        names = f"{point_label(one)} and {point_label(other)} seem to be interchanged"
        text = f"{names} in the shots from {station}" if station else f"the known points {names}"
        members = [*((i, shift) for i in ours), *((i, -shift) for i in others)]
        found.append(_change(fit, members, text, choices[station == KNOWN]))
    return found


def _mistyped(fit: PlaneFit, suspects: Sequence[int]) -> list[ValueChange]:
    found: list[ValueChange] = []
    for i in suspects:
        one = fit.measurements[i]
        east, north = one.place.real, one.place.imag
        variants = [(complex(value, north), f"E ({text})") for value, text in mistyped(east, one.decimals)]
        variants += [(complex(east, value), f"N ({text})") for value, text in mistyped(north, one.decimals)]
        variants.append((complex(north, east), "E and N (exchanged)"))
        for place, what in variants:
            text = (
                f"{one.label} seems to be mistyped in {what}: {place.real:.{one.decimals}f}, "
                f"{place.imag:.{one.decimals}f} would fit"
            )
            found.append(_change(fit, [(i, place - one.place)], text, len(variants) * len(fit.measurements)))
    return found


def _change(fit: PlaneFit, members: Sequence[tuple[int, complex]], text: str, choices: int) -> ValueChange:
    """A hypothesis that these measurements should have been otherwise, each by so much in its own frame."""
    moved = [-fit.maps[fit.measurements[i].station].a * by for i, by in members]
    sigma_m = [fit.measurements[i].sigma_m for i, _ in members]
    return ValueChange(text, tuple(i for i, _ in members), whitened(moved, sigma_m), choices)


TOLERANCE_M = 0.1
"""Points agree on a rough frame where they miss by less, metres, ..."""
TOLERANCE_SIGMAS = 6.0
"""... or by less than this many of the greatest standard deviation."""
MOST_SUSPECTS = 40
"""Measurements for which swaps and typing errors are tried."""


@dataclass(frozen=True)
class GrossError:
    """Something wrong that was named and left out."""

    points: tuple[str, ...]
    """Whose measurements are left out."""
    text: str
    """One sentence."""


def search_network(
    measured: Sequence[Measurement], *, free_scale: bool = False
) -> tuple[PlaneFit, tuple[GrossError, ...]]:
    """Adjust shots and known points; leave out, one by one, what contradicts the others, and say what it may be.

    Raises SurveyError where the frames are not determined, also where what is left out leaves too little.
    """
    used = {shot.point for shot in measured if shot.station}
    good = [one for one in measured if one.station or one.point in used]
    frames = _rough_frames(good)
    fit_of = partial(adjust_plane, start=frames, free_scale=free_scale)
    errors: list[GrossError] = []
    try:
        while True:
            fit = fit_of(good, rounds=1)
            try:
                noise = fit_of(_agreeing(good, frames, _tolerance_m(good)), rounds=1).adjusted.noise_level
            except SingularError:
                noise = NoiseLevel(1.0, PRIOR_FREEDOM)
            suspects = suspicious(fit.adjusted, noise)[:MOST_SUSPECTS]
            if not suspects:
                break
            changes = [*_interchanged(fit, suspects), *_mistyped(fit, suspects)]
            sigma_m = np.array([one.sigma_m for one in fit.measurements])
            found = explanations(fit.adjusted, sigma_m, noise, suspects, changes)
            errors.append(_gross_error(fit, found))
            wrong = {i for one in found for i in one.measurements}
            good = [one for i, one in enumerate(fit.measurements) if i not in wrong]
        if errors:
            _still_determined(good, errors)
        return fit_of(good), tuple(errors)
    except SingularError as error:
        raise SurveyError(_undetermined(errors)) from error


def _tolerance_m(measurements: Sequence[Measurement]) -> float:
    return max(TOLERANCE_M, TOLERANCE_SIGMAS * max((one.sigma_m for one in measurements), default=0.0))


def _still_determined(good: Sequence[Measurement], errors: Sequence[GrossError]) -> None:
    """Raise SurveyError where what is left does not place every station.

    The adjustment itself would not notice: residuals look like a little knowledge of a turn that nothing determines.
    """
    try:
        _rough_frames(good)
    except SurveyError as error:
        left_out = "; ".join(one.text for one in errors)
        raise SurveyError(f"{error}; skipped as wrong: {left_out}") from error


def _rough_frames(measured: Sequence[Measurement]) -> dict[str, Similarity2]:
    """A map to the building for each station, by all that agrees with the rough ones: a line is then good about it."""
    tolerance_m = _tolerance_m(measured)
    places: dict[str, dict[str, list[complex]]] = defaultdict(lambda: defaultdict(list))
    for one in measured:
        places[one.station][one.point].append(one.place)
    known = {point: some[-1] for point, some in places.pop(KNOWN, {}).items()}
    stations = {name: {point: _middle(some) for point, some in points.items()} for name, points in places.items()}
    frames = {KNOWN: Similarity2.identity(), **rough_frames(known, stations, tolerance_m)}
    try:
        return frames | dict(adjust_plane(_agreeing(measured, frames, tolerance_m), frames).maps)
    except SingularError:
        return frames


def _middle(places: Sequence[complex]) -> complex:
    values = np.array(places)
    return complex(np.median(values.real), np.median(values.imag))


def _agreeing(
    measured: Sequence[Measurement], frames: Mapping[str, Similarity2], tolerance_m: float
) -> list[Measurement]:
    """What is where most say that its point is (the known place where there is one that any shot confirms)."""
    placed = [frames[one.station].a * one.place + frames[one.station].b for one in measured]
    of_point: dict[str, list[complex]] = defaultdict(list)
    for one, place in sorted(zip(measured, placed, strict=True), key=lambda pair: pair[0].station != KNOWN):
        of_point[one.point].append(place)
    middle = {}
    for point, places in of_point.items():
        votes = [sum(abs(other - place) < tolerance_m for other in places) for place in places]
        middle[point] = places[votes.index(max(votes))]
    return [one for one, place in zip(measured, placed, strict=True) if abs(place - middle[one.point]) < tolerance_m]


def _undetermined(errors: Sequence[GrossError]) -> str:
    message = (
        "the frames of the stations are not determined: each needs two points at different places that are known, or "
        "that a station with a determined frame measured"
    )
    if errors:
        message += "; skipped as wrong: " + "; ".join(error.text for error in errors)
    return message


def _gross_error(fit: PlaneFit, found: Sequence[Explanation]) -> GrossError:
    """Put the best explanation, and those that are as good, into one sentence."""
    measurements: list[int] = list(dict.fromkeys(i for one in found for i in one.measurements))
    texts = [one.text or f"{listed([fit.measurements[i].label for i in one.measurements])} is wrong" for one in found]
    best = found[0]
    text = texts[0]
    if not best.text and len(found) == 1:
        text += _how_far(fit, best.measurements[0])
    if len(found) > 1:
        text = "either " + ", or ".join(texts) + " (it cannot be determined which)"
    points = tuple(dict.fromkeys(fit.measurements[i].point for i in measurements))
    return GrossError(points, text)


def _how_far(fit: PlaneFit, measurement: int) -> str:
    """By how much a measurement is off, as the others have it, and whether another point is there."""
    rows = fit.adjusted.rows(measurement)
    kernel = fit.adjusted.kernel(rows)
    off = np.linalg.pinv(kernel) @ fit.adjusted.residual[rows] * fit.measurements[measurement].sigma_m
    one = fit.measurements[measurement]
    text = f" by {np.hypot(*off):.3f} m ({-off[0]:+.3f}, {-off[1]:+.3f})"
    if one.station:
        place = fit.maps[one.station].a * one.place + fit.maps[one.station].b
        near = [name for name, other in fit.places.items() if name != one.point and abs(other - place) < TOLERANCE_M]
        if near:
            text += f"; it is at the position of {point_label(near[0])}, so its name may be wrong"
    return text
