"""Scores of a model's positions, and the choice of the model with the smallest error.

The figures are those of ISO/IEC 18305, EvAAL and the IPIN competition. Models are compared within a time budget, by
cross-validation over walks.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from vislam2tag.common.error_statistics import mean_interval
from vislam2tag.common.errors import DatasetError
from vislam2tag.common.progress import Progress, silent
from vislam2tag.common.records import Record
from vislam2tag.core.arrays import BoolArray, FloatArray
from vislam2tag.positioning.places import LabelledScans, Positions, ScanPlaces, folds, walk_numbers
from vislam2tag.positioning.registry import model_named

FLOOR_PENALTY_M = 15.0
"""Penalty for each wrong floor in the IPIN score, metres."""
BUILDING_PENALTY_M = 50.0
"""Penalty for a wrong building in the IPIN score (EvAAL-ETRI), metres."""


class ErrorQuantiles(Record):
    """Quantiles of errors, metres; None without errors."""

    scans: int
    mean_m: float | None = None
    median_m: float | None = None
    p75_m: float | None = None
    p95_m: float | None = None
    rmse_m: float | None = None
    max_m: float | None = None


class Score(Record):
    """Figures of one model on one test set."""

    scans: int
    """All scans of the test set."""
    answered: float
    """Share of them with an answer, 0 to 1; all other figures are over these."""
    floor_hit: float | None
    """Share on the right floor (and in the right building)."""
    building_hit: float | None
    plane: ErrorQuantiles
    """Error in the plane, whatever the floor."""
    plane_on_floor: ErrorQuantiles
    """The same for scans on the right floor."""
    space: ErrorQuantiles
    """Error in space, if heights are known."""
    ipin_m: float | None
    """Third quartile of the error in the plane plus 15 m for each floor of error (50 m for a wrong building)."""
    inside_68: float | None
    """Share of true places inside the stated 68 % circle; None without circles."""
    inside_95: float | None


def plane_error_m(found: Positions, truth: ScanPlaces) -> FloatArray:
    """(n,) distance in the plane; NaN if the answer is unknown."""
    return truth.distance_m(found.xy)


def score(found: Positions, truth: ScanPlaces) -> Score:
    """Compare positions (n) with the truth (n), which must have the model's storeys.

    Raises ValueError if they have others.
    """
    if found.storeys != truth.storeys:
        raise ValueError("positions and truth have different storeys")
    known = found.known
    answered, true = found[known], truth[known]
    error = plane_error_m(answered, true)
    right = answered.storey == true.storey
    same_building = _buildings(found)[answered.storey] == _buildings(found)[true.storey]
    return Score(
        scans=len(truth),
        answered=float(known.mean()) if len(truth) else 0.0,
        floor_hit=_share(right),
        building_hit=_share(same_building),
        plane=error_quantiles(error),
        plane_on_floor=error_quantiles(error[right]),
        space=error_quantiles(np.hypot(error, answered.z - true.z)),
        ipin_m=error_quantiles(error + _penalty_m(answered, true, same_building)).p75_m,
        inside_68=_inside(error, answered.radius_68_m),
        inside_95=_inside(error, answered.radius_95_m),
    )


def error_quantiles(error_m: FloatArray) -> ErrorQuantiles:
    """Reduce errors (n,) to figures; errors that are not finite are ignored."""
    error_m = error_m[np.isfinite(error_m)]
    if not len(error_m):
        return ErrorQuantiles(scans=0)
    median, p75, p95 = np.quantile(error_m, [0.5, 0.75, 0.95])
    return ErrorQuantiles(
        scans=len(error_m),
        mean_m=float(error_m.mean()),
        median_m=float(median),
        p75_m=float(p75),
        p95_m=float(p95),
        rmse_m=float(np.sqrt(np.mean(error_m**2))),
        max_m=float(error_m.max()),
    )


def _penalty_m(found: Positions, truth: ScanPlaces, same_building: BoolArray) -> FloatArray:
    """(n,) penalties for wrong floors and buildings, metres."""
    floors_off = np.abs(found.floor - truth.floor)
    return np.asarray(FLOOR_PENALTY_M * floors_off + np.where(same_building, 0.0, BUILDING_PENALTY_M))


def _buildings(found: Positions) -> FloatArray:
    """(storeys,) a number for each storey's building."""
    names = [storey.building for storey in found.storeys]
    return np.array([names.index(name) for name in names])


def _inside(error_m: FloatArray, radius_m: FloatArray) -> float | None:
    """Share of errors (n,) within radii (n,); None without radii."""
    stated = np.isfinite(radius_m) & np.isfinite(error_m)
    return _share(error_m[stated] <= radius_m[stated])


def _share(hits: BoolArray) -> float | None:
    """Share of hits (n,); None of none."""
    return float(hits.mean()) if len(hits) else None


CANDIDATES = ("weighted-knn", "local-kriging", "cell-density")
"""Candidates in this order, the fastest first."""
BUDGET_S = 300.0
_FOLDS = 5
_PROBED_WITH = 300
"""Number of scans in a first trial, which estimates how long training takes."""
_SEED = 0


@dataclass(frozen=True)
class TriedModel:
    """Result of a model in cross-validation over walks."""

    name: str
    mean_m: float
    """Mean error in the plane, metres; NaN if it was not tried."""
    floor_hit: float
    score_m: float
    """Mean of the error plus 15 m for each scan on a wrong floor, metres; the model with the smallest is chosen."""
    behind_m: tuple[float, float] | None
    """95 % interval, over walks, of its score minus that of the chosen model; None for few walks."""
    why: str
    """Why it was chosen, or not, in words."""


@dataclass(frozen=True)
class ModelTrial:
    """All candidates, the chosen one first."""

    tried: tuple[TriedModel, ...]

    @property
    def chosen(self) -> TriedModel:
        """The best model."""
        return self.tried[0]


@dataclass(frozen=True)
class _Outcome:
    """Answers to all held-out scans, fold after fold."""

    name: str
    error_m: FloatArray
    right: BoolArray

    @property
    def cost_m(self) -> FloatArray:
        """(n,) error plus penalty of each scan."""
        return self.error_m + FLOOR_PENALTY_M * ~self.right

    def mean_cost_m(self) -> float:
        """Mean over all scans."""
        return float(self.cost_m.mean())


def tried_models(
    labelled: LabelledScans,
    budget_s: float = BUDGET_S,
    progress: Progress[float] = silent,
    clock: Callable[[], float] = time.monotonic,
    candidates: Sequence[str] = CANDIDATES,
) -> ModelTrial:
    """Cross-validate the candidates over walks, or over scans if the data have no walks.

    Candidates that would exceed the time budget are skipped, except the first. Raises DatasetError if there are too few
    scans.
    """
    scans, places = labelled
    usable = (scans.heard > 0) & np.isfinite(places.xy).all(axis=1) & (places.storey >= 0)
    scans, places = scans[usable], places[usable]
    walk = walk_numbers(scans, places)
    parts = list(folds(walk, _FOLDS, _SEED))
    if not parts:
        raise DatasetError("models cannot be compared on a single fingerprint; choose one with --model")
    truth = [(scans[held_out], places[held_out]) for _, held_out in parts]
    most = max(int(learn.sum()) for learn, _ in parts)
    begun, made, too_long = clock(), list[_Outcome](), list[str]()
    for number, name in enumerate(candidates):
        if number and clock() - begun + len(parts) * _expected_s(name, (scans, places), most, clock) > budget_s:
            too_long.append(name)
            continue
        found = [
            model_named(name).fit(scans[learn], places[learn]).predict(asked)
            for (learn, _), (asked, _) in zip(parts, truth, strict=True)
        ]
        made.append(_outcome(name, found, truth))
        progress(number + 1, len(candidates))
    made.sort(key=_Outcome.mean_cost_m)
    walks = np.concatenate([walk[held_out] for _, held_out in parts])
    told = [_tried(one, made[0], walks) for one in made]
    return ModelTrial((*told, *(_left_out(name) for name in too_long)))


def _expected_s(name: str, labelled: LabelledScans, most: int, clock: Callable[[], float]) -> float:
    """Estimate the training time for ``most`` scans from some of them; no estimate for few scans."""
    scans, places = labelled
    probe = np.sort(np.random.default_rng(_SEED).permutation(len(scans))[:_PROBED_WITH])
    if len(probe) == len(scans):
        return 0.0
    started = clock()
    model_named(name).fit(scans[probe], places[probe])
    return (clock() - started) * most / len(probe)


def _outcome(name: str, found: Sequence[Positions], truth: Sequence[LabelledScans]) -> _Outcome:
    """Compare with the truth; a scan without an answer counts with the largest error."""
    error_m = np.concatenate([plane_error_m(one, places) for one, (_, places) in zip(found, truth, strict=True)])
    right = np.concatenate([one.storey == places.storey for one, (_, places) in zip(found, truth, strict=True)])
    return _Outcome(name, np.where(np.isnan(error_m), np.nanmax(error_m), error_m), right)


def _tried(one: _Outcome, chosen: _Outcome, walks: FloatArray) -> TriedModel:
    mean_m, score_m = float(one.error_m.mean()), one.mean_cost_m()
    why = "chosen: the best" if one is chosen else f"{score_m / chosen.mean_cost_m() - 1:.1%} worse"
    behind_m = None if one is chosen else mean_interval(one.cost_m - chosen.cost_m, walks)
    return TriedModel(one.name, mean_m, float(one.right.mean()), score_m, behind_m, why)


def _left_out(name: str) -> TriedModel:
    unknown = float("nan")
    return TriedModel(name, unknown, unknown, unknown, None, "not tried: takes longer than the time budget")
