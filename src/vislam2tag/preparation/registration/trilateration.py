"""Landmarks by tape: placed from distances, gross errors named, mirror solutions reported."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, field, replace

import networkx as nx
import numpy as np

from vislam2tag.preparation.registration.distance_equations import (
    Equation,
    StartingPlaces,
    adjusted_at,
    least_squares_places,
    misclosure,
    starting_places,
)
from vislam2tag.preparation.registration.least_squares import (
    PRIOR_FREEDOM,
    Adjusted,
    NoiseLevel,
    SingularError,
    ValueChange,
    explanations,
    listed,
    mistyped,
    suspicious,
)
from vislam2tag.preparation.registration.record import PositionSource, RegisteredPoint, Residual
from vislam2tag.preparation.registration.results import placed_point
from vislam2tag.preparation.registration.tape_and_clicks import TapeDistance, Target

AGREES_SIGMAS = 4.0
"""At the start a distance that misses by less is taken for good."""
AS_GOOD = 9.2
"""Places whose squares differ by less (chi squared, 2, one percent) cannot be distinguished."""
SAME_PLACE_M = 0.05
NEARER = 3.0
"""An expected place decides between two where it is so many times closer to one."""
GREATEST_SIGMA_M = 0.5
"""A landmark that is not known better has no position."""

UNDETERMINED = "its distances do not determine a position inside the plan: measure more"

PlanBounds = tuple[float, float, float, float]
"""Left, right, lower and upper edge of a plan, BCS metres."""


@dataclass
class TapeResult:
    """Landmarks placed, those that are not with the reason, and what was left out."""

    placed: dict[str, RegisteredPoint] = field(default_factory=dict)
    unplaced: dict[str, str] = field(default_factory=dict)
    errors: list[str] = field(default_factory=list)
    residuals: list[Residual] = field(default_factory=list)
    """Of each distance used."""


_Solution = tuple[StartingPlaces, dict[str, complex], Adjusted]


def trilaterate(
    distances: Sequence[TapeDistance],
    targets: Mapping[str, Target],
    *,
    extent_m: PlanBounds | None = None,
    expected: Mapping[str, complex] | None = None,
) -> TapeResult:
    """Place every landmark that has two distances or more to targets, or to other such landmarks.

    What has a name in ``targets`` is fixed. ``extent_m`` (left, right, lower, upper) and ``expected`` places (planned,
    or clicked) only decide between places that the distances cannot distinguish.
    """
    result = TapeResult()
    free = [one for one in distances if one.landmark not in targets]
    led_to = Counter(one.to for one in free if one.to not in targets)
    landmarks = {one.landmark for one in free} | {name for name, count in led_to.items() if count > 1}
    for name in sorted(led_to.keys() - landmarks):
        result.errors.append(f"{name} is neither a known point, a wall nor a landmark: distances to it are skipped")
    equations = [
        Equation(one, targets.get(one.to), "" if one.to in targets else one.to)
        for one in free
        if one.to in landmarks or one.to in targets
    ]
    graph = nx.Graph()
    graph.add_nodes_from(dict.fromkeys(name for one in free for name in (one.landmark, one.to) if name in landmarks))
    graph.add_edges_from((one.distance.landmark, one.other) for one in equations if one.other)
    for component in nx.connected_components(graph):
        mine = [one for one in equations if one.distance.landmark in component]
        names = [name for name in graph if name in component]
        solutions, order = _solutions(mine, names, extent_m, result)
        if solutions:
            _keep_sure(solutions, order, expected or {}, result)
    return result


def _placing_order(equations: Sequence[Equation], names: Sequence[str]) -> list[str]:
    """Landmarks in an order in which each has two distances to targets or earlier ones; the others are left out."""
    order: list[str] = []
    while True:
        counts = {
            name: sum(
                not one.other or (one.distance.landmark in order or one.other in order)
                for one in equations
                if name in (one.distance.landmark, one.other)
            )
            for name in names
            if name not in order
        }
        best = max(counts, key=lambda name: counts[name], default=None)
        if best is None or counts[best] < 2:
            return order
        order.append(best)


def _solutions(
    equations: Sequence[Equation], names: Sequence[str], extent_m: PlanBounds | None, result: TapeResult
) -> tuple[list[_Solution], list[str]]:
    """The best places of one connected group of landmarks, and others as good; the landmarks in order of placing."""
    good = list(equations)
    while True:
        order = _placing_order(good, names)
        good = [one for one in good if one.distance.landmark in order and (not one.other or one.other in order)]
        begun = starting_places(good, order) if order else []
        wrong = _contradicting_distances(begun[0], order, result) if begun else ()
        if not wrong:
            break
        good = [one for one in good if one.distance not in wrong]
    few = "it has fewer than two usable distances: measure more"
    result.unplaced |= {name: few for name in names if name not in order}
    solutions = _as_good(begun, order, extent_m)
    if not solutions:
        result.unplaced |= dict.fromkeys(order, UNDETERMINED)
    return solutions, order


def _contradicting_distances(
    start: StartingPlaces, names: Sequence[str], result: TapeResult
) -> tuple[TapeDistance, ...]:
    """The distances that contradict the others, at most as many as cannot be distinguished; they are named."""
    try:
        places, noise = _places_without_outliers(start, names)
        adjusted = adjusted_at(start.equations, names, places)
    except SingularError:
        return ()
    suspects = suspicious(adjusted, noise)
    if not suspects:
        return ()
    sigma_m = np.array([one.sigma_m for one in start.equations])
    found = explanations(adjusted, sigma_m, noise, suspects, _typing_errors(start.equations, suspects))
    wrong = sorted({i for one in found for i in one.measurements})
    if len(found) == 1:
        off = adjusted.residual[wrong[0]] / adjusted.kernel(adjusted.rows(wrong[0]))[0, 0] * sigma_m[wrong[0]]
        label = start.equations[wrong[0]].distance.label
        result.errors.append(found[0].text or f"{label} is wrong by {-off:+.2f} m")
    else:
        names_of = listed([start.equations[i].distance.label for i in wrong])
        result.errors.append(f"one of {names_of} is wrong (it cannot be determined which)")
    return tuple(start.equations[i].distance for i in wrong)


def _places_without_outliers(start: StartingPlaces, names: Sequence[str]) -> tuple[dict[str, complex], NoiseLevel]:
    """Places by the distances that agree at the start, and their noise."""
    near = np.abs(misclosure(start.equations, start.places)) < AGREES_SIGMAS
    kept = tuple(one for one, good in zip(start.equations, near.tolist(), strict=True) if good)
    with suppress(SingularError):
        if len(kept) >= 2 * len(names):  # fewer, perhaps none, do not determine them
            places = least_squares_places(replace(start, equations=kept), names)
            return places, adjusted_at(kept, names, places).noise_level
    return least_squares_places(start, names), NoiseLevel(1.0, PRIOR_FREEDOM)


def _typing_errors(equations: Sequence[Equation], suspects: Sequence[int]) -> list[ValueChange]:
    found: list[ValueChange] = []
    for i in suspects:
        one = equations[i].distance
        variants = [pair for pair in mistyped(one.distance_m, one.decimals) if pair[0] > 0]
        for value, what in variants:
            text = f"{one.label} seems to be mistyped ({what}): {value:.{one.decimals}f} would fit"
            by = np.array([(one.distance_m - value) / equations[i].sigma_m])
            found.append(ValueChange(text, (i,), by, len(variants) * len(equations)))
    return found


def _keep_sure(
    solutions: Sequence[_Solution], names: Sequence[str], expected: Mapping[str, complex], result: TapeResult
) -> None:
    """Choose among the least-squares solutions for each landmark, and keep what is sure."""
    start, _, adjusted = solutions[0]
    for i, one in enumerate(start.equations):
        checked = float(adjusted.kernel(adjusted.rows(i))[0, 0])
        sigmas = -float(adjusted.residual[i] / np.sqrt(max(checked, 1e-6) * adjusted.variance_factor))
        off_m = round(-float(adjusted.residual[i]) * one.sigma_m, 4)
        label = one.distance.label
        residual = Residual(measurement=label, off_m=off_m, sigmas=round(sigmas, 2), checked=round(checked, 3))
        result.residuals.append(residual)
    for index, name in enumerate(names):
        chosen, note = _decide_between([places[name] for _, places, _ in solutions], expected.get(name))
        if chosen is None:
            result.unplaced[name] = note
            continue
        start, places, adjusted = solutions[chosen]
        rows = slice(2 * index, 2 * index + 2)
        block = np.asarray(adjusted.cofactor[rows, rows] * adjusted.variance_factor)
        if np.sqrt(np.trace(block) / 2) > GREATEST_SIGMA_M:
            result.unplaced[name] = "its distances hardly determine it: measure to a target in another direction"
        else:
            count = sum(name in (one.distance.landmark, one.other) for one in start.equations)
            origin = (PositionSource.TAPE, count, adjusted.redundancy / count)
            result.placed[name] = placed_point(name, places[name], block, origin).model_copy(update={"note": note})


def _as_good(begun: Sequence[StartingPlaces], names: Sequence[str], extent_m: PlanBounds | None) -> list[_Solution]:
    """Different solutions as good as the best, which comes first; none beyond a wall's end or outside the plan."""
    found: list[_Solution] = []
    for start in begun:
        if _same_as_any(start.places, found):
            continue
        places = least_squares_places(start, names)
        beyond = any(one.beyond(places) for one in start.equations) or not _inside(places, extent_m)
        if beyond or _same_as_any(places, found):
            continue
        with suppress(SingularError):
            found.append((start, places, adjusted_at(start.equations, names, places)))
    found.sort(key=lambda one: one[2].square)
    return [one for one in found if one[2].square < found[0][2].square + AS_GOOD * found[0][2].variance_factor]


def _same_as_any(places: Mapping[str, complex], found: Sequence[_Solution]) -> bool:
    return any(all(abs(place - other[name]) < SAME_PLACE_M for name, place in places.items()) for _, other, _ in found)


def _inside(places: Mapping[str, complex], extent_m: PlanBounds | None) -> bool:
    if extent_m is None:
        return True
    left, right, low, high = extent_m
    return all(left <= place.real <= right and low <= place.imag <= high for place in places.values())


def _decide_between(rivals: Sequence[complex], expected: complex | None) -> tuple[int | None, str]:
    """Which of the places, or None with the reason; an expected place may decide."""
    far = [i for i, place in enumerate(rivals) if abs(place - rivals[0]) > SAME_PLACE_M]
    if not far:
        return 0, ""
    if expected is not None:
        near, second = sorted((0, *far), key=lambda i: abs(rivals[i] - expected))[:2]
        if NEARER * abs(rivals[near] - expected) < abs(rivals[second] - expected):
            return near, "two positions are possible; the one closer to the expected position was used"
    texts = " or ".join(f"({rivals[i].real:.2f}, {rivals[i].imag:.2f})" for i in (0, *far))
    return None, f"may be at {texts}: measure one more distance, or click it on the plan"
