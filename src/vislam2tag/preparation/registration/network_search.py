"""The plane network with its gross errors found, named and left out."""

from __future__ import annotations

import itertools
from collections import defaultdict
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from vislam2tag.common.errors import SurveyError
from vislam2tag.core.arrays import IntArray
from vislam2tag.core.transforms import Similarity2
from vislam2tag.preparation.registration.consensus import rough_frames
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
from vislam2tag.preparation.registration.names import point_label
from vislam2tag.preparation.registration.network import ROUNDS, KnownPoint, Measurement, PlaneFit, Shot, adjust_plane


def network_changes(fit: PlaneFit, suspects: Sequence[int]) -> list[ValueChange]:
    """What could explain the suspects (indices of measurements), each with what would then have been measured."""
    return [*_swapped_shots(fit, suspects), *_swapped_known(fit, suspects), *_mistyped(fit, suspects)]


def _swapped_shots(fit: PlaneFit, suspects: Sequence[int]) -> list[ValueChange]:
    """Two points of one station whose names were interchanged, one of them suspect."""
    rows_of: dict[str, dict[str, list[int]]] = defaultdict(lambda: defaultdict(list))
    for i, shot in enumerate(fit.shots):
        rows_of[shot.station][shot.point].append(i)
    suspect = {(fit.shots[i].station, fit.shots[i].point) for i in suspects if i < len(fit.shots)}
    pairs = sorted(
        {
            (station, min(point, other), max(point, other))
            for station, point in suspect
            for other in rows_of[station]
            if other != point
        }
    )
    found = []
    for station, one, other in pairs:
        places = {name: np.mean([fit.shots[i].place for i in rows_of[station][name]]) for name in (one, other)}
        shift = complex(places[other] - places[one])
        members = [(i, shift) for i in rows_of[station][one]] + [(i, -shift) for i in rows_of[station][other]]
        text = f"{point_label(one)} and {point_label(other)} look interchanged in the shots from {station}"
        found.append(_change(fit, members, text, len(pairs)))
    return found


def _swapped_known(fit: PlaneFit, suspects: Sequence[int]) -> list[ValueChange]:
    first = len(fit.shots)
    points = {fit.measurements[i].point for i in suspects}
    pairs = [
        (i, j)
        for i, j in itertools.combinations(range(len(fit.known)), 2)
        if points & {fit.known[i].point, fit.known[j].point}
    ]
    found = []
    for i, j in pairs:
        shift = fit.known[j].place - fit.known[i].place
        names = [point_label(fit.known[one].point) for one in (i, j)]
        text = f"the known points {listed(names)} look interchanged"
        found.append(_change(fit, [(first + i, shift), (first + j, -shift)], text, len(pairs)))
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
                f"{one.label} looks mistyped in {what}: {place.real:.{one.decimals}f}, {place.imag:.{one.decimals}f} "
                "would fit"
            )
            found.append(_change(fit, [(i, place - one.place)], text, len(variants) * len(fit.measurements)))
    return found


def _change(fit: PlaneFit, members: Sequence[tuple[int, complex]], text: str, choices: int) -> ValueChange:
    """A hypothesis that these measurements should have been otherwise, each by so much in its own frame."""
    moved = [-(fit.maps[fit.shots[i].station].a if i < len(fit.shots) else 1) * by for i, by in members]
    rows = np.concatenate([fit.groups[i] for i, _ in members])
    sigma_m = [fit.measurements[i].sigma_m for i, _ in members]
    return ValueChange(text, tuple(i for i, _ in members), rows, whitened(moved, sigma_m), choices)


TOLERANCE_M = 0.1
"""Points agree on a rough frame where they miss by less, metres, ..."""
TOLERANCE_SIGMAS = 6.0
"""... or by less than this many of the greatest standard deviation."""
MOST_SUSPECTS = 40
"""Measurements for which swaps and typing errors are tried."""


@dataclass(frozen=True)
class GrossError:
    """Something wrong that was named and left out."""

    labels: tuple[str, ...]
    """The measurements left out."""
    points: tuple[str, ...]
    text: str
    """One sentence."""


@dataclass(frozen=True)
class SearchedNetwork:
    """The fit without what is wrong."""

    fit: PlaneFit
    errors: tuple[GrossError, ...]


def search_network(shots: Sequence[Shot], known: Sequence[KnownPoint], *, free_scale: bool = False) -> SearchedNetwork:
    """Adjust shots and known points; leave out, one by one, what contradicts the others, and say what it may be.

    Raises SurveyError where the frames are not determined, also where what is left out leaves too little.
    """
    used = {shot.point for shot in shots}
    known = [one for one in known if one.point in used]
    network = _RoughNetwork(_rough_frames(shots, known), free_scale)
    good: list[Measurement] = [*shots, *known]
    errors: list[GrossError] = []
    while True:
        fit = network.adjusted(good, errors, rounds=1)
        noise = network.noise(good)
        suspects = suspicious(fit.adjusted, fit.groups, noise)
        if not suspects:
            break
        looked_at = [i for i, _ in suspects[:MOST_SUSPECTS]]
        changes = network_changes(fit, looked_at)
        sigma_m = np.array([one.sigma_m for one in fit.measurements])
        found = explanations(fit.adjusted, fit.groups, sigma_m, noise, looked_at, changes)
        errors.append(_gross_error(fit, found))
        wrong = {i for one in found for i in one.measurements}
        good = [one for i, one in enumerate(fit.measurements) if i not in wrong]
    if errors:
        _still_determined(good, errors)
    return SearchedNetwork(network.adjusted(good, errors), tuple(errors))


@dataclass(frozen=True)
class _RoughNetwork:
    """Rough frames of the stations, about which measurements are adjusted."""

    frames: Mapping[str, Similarity2]
    free_scale: bool

    def adjusted(
        self, good: Sequence[Measurement], errors: Sequence[GrossError], rounds: int | None = None
    ) -> PlaneFit:
        """Adjust measurements; raises SurveyError, which names the ``errors`` left out, where they are too few."""
        try:
            return self._fit(*_shots_and_known(good), rounds)
        except SingularError as error:
            raise SurveyError(_undetermined(errors)) from error

    def noise(self, good: Sequence[Measurement]) -> NoiseLevel:
        """The noise of what is no gross error at first sight."""
        shots, known = _shots_and_known(good)
        kept, places = _agreeing(shots, known, self.frames, _tolerance_m(good))
        try:
            return self._fit(kept, places, 1).adjusted.noise_level
        except SingularError:
            return NoiseLevel(1.0, PRIOR_FREEDOM)

    def _fit(self, shots: Sequence[Shot], known: Sequence[KnownPoint], rounds: int | None) -> PlaneFit:
        return adjust_plane(shots, known, self.frames, free_scale=self.free_scale, rounds=rounds or ROUNDS)


def _tolerance_m(measurements: Sequence[Measurement]) -> float:
    return max(TOLERANCE_M, TOLERANCE_SIGMAS * max((one.sigma_m for one in measurements), default=0.0))


def _still_determined(good: Sequence[Measurement], errors: Sequence[GrossError]) -> None:
    """Raise SurveyError where what is left does not place every station.

    The adjustment itself would not notice: residuals look like a little knowledge of a turn that nothing determines.
    """
    try:
        _rough_frames(*_shots_and_known(good))
    except SurveyError as error:
        left_out = "; ".join(one.text for one in errors)
        raise SurveyError(f"{error}; left out as wrong: {left_out}") from error


def _shots_and_known(measurements: Sequence[Measurement]) -> tuple[list[Shot], list[KnownPoint]]:
    return [m for m in measurements if isinstance(m, Shot)], [m for m in measurements if isinstance(m, KnownPoint)]


def _rough_frames(shots: Sequence[Shot], known: Sequence[KnownPoint]) -> dict[str, Similarity2]:
    tolerance_m = _tolerance_m([*shots, *known])
    by_station: dict[str, dict[str, list[complex]]] = defaultdict(lambda: defaultdict(list))
    for shot in shots:
        by_station[shot.station][shot.point].append(shot.place)
    stations = {
        name: {point: _middle(places) for point, places in points.items()} for name, points in by_station.items()
    }
    frames = rough_frames({one.point: one.place for one in known}, stations, tolerance_m)
    return _refined_frames(shots, known, frames, tolerance_m)


def _middle(places: Sequence[complex]) -> complex:
    values = np.array(places)
    return complex(np.median(values.real), np.median(values.imag))


def _refined_frames(
    shots: Sequence[Shot], known: Sequence[KnownPoint], frames: dict[str, Similarity2], tolerance_m: float
) -> dict[str, Similarity2]:
    """The frames by all that agrees with the rough ones, so that a line is a good approximation about them."""
    kept, places = _agreeing(shots, known, frames, tolerance_m)
    try:
        return frames | dict(adjust_plane(kept, places, frames).maps)
    except SingularError:
        return frames


def _agreeing(
    shots: Sequence[Shot], known: Sequence[KnownPoint], frames: Mapping[str, Similarity2], tolerance_m: float
) -> tuple[list[Shot], list[KnownPoint]]:
    """What lies where most say that its point is (the known place where there is one that any shot confirms)."""
    mapped: dict[str, list[complex]] = defaultdict(list)
    for one in known:
        mapped[one.point].append(one.place)
    for shot in shots:
        mapped[shot.point].append(frames[shot.station].a * shot.place + frames[shot.station].b)
    middle = {}
    for point, places in mapped.items():
        votes = [sum(abs(other - place) < tolerance_m for other in places) for place in places]
        middle[point] = places[votes.index(max(votes))]
    near = [
        shot
        for shot in shots
        if abs(frames[shot.station].a * shot.place + frames[shot.station].b - middle[shot.point]) < tolerance_m
    ]
    return near, [one for one in known if abs(one.place - middle[one.point]) < tolerance_m]


def _undetermined(errors: Sequence[GrossError]) -> str:
    message = (
        "the stations' frames are not determined: each needs two points at different places that are known, or shot "
        "from a station whose frame is"
    )
    if errors:
        message += "; left out as wrong: " + "; ".join(error.text for error in errors)
    return message


def _gross_error(fit: PlaneFit, found: Sequence[Explanation]) -> GrossError:
    """Put the best explanation, and those that are as good, into one sentence."""
    measurements: list[int] = list(dict.fromkeys(i for one in found for i in one.measurements))
    labels = tuple(fit.measurements[i].label for i in measurements)
    texts = [one.text or f"{listed([fit.measurements[i].label for i in one.measurements])} is off" for one in found]
    best = found[0]
    text = texts[0]
    if not best.text and len(found) == 1:
        text += _how_far(fit, best.measurements[0])
    if len(found) > 1:
        text = "either " + ", or ".join(texts) + " (nothing tells which)"
    points = tuple(dict.fromkeys(fit.measurements[i].point for i in measurements))
    return GrossError(labels, points, text)


def _how_far(fit: PlaneFit, measurement: int) -> str:
    """By how much a measurement is off, as the others have it, and whether another point is there."""
    rows: IntArray = fit.groups[measurement]
    kernel = fit.adjusted.kernel(rows)
    off = np.linalg.pinv(kernel) @ fit.adjusted.residual[rows] * fit.measurements[measurement].sigma_m
    one = fit.measurements[measurement]
    text = f" by {np.hypot(*off):.3f} m ({-off[0]:+.3f}, {-off[1]:+.3f})"
    if isinstance(one, Shot):
        place = fit.maps[one.station].a * one.place + fit.maps[one.station].b
        near = [name for name, other in fit.places.items() if name != one.point and abs(other - place) < TOLERANCE_M]
        if near:
            text += f"; it is where {point_label(near[0])} is: misnamed?"
    return text
