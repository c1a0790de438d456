"""How good a model's positions are, by the figures that the field reports, and which model has the smallest error.

The figures are those of ISO/IEC 18305, EvAAL and the IPIN competition. Models are compared within a time budget on
walks that they did not learn from.
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
"""What a wrong floor costs in the IPIN score, metres a floor."""
BUILDING_PENALTY_M = 50.0
"""What a wrong building costs in the IPIN score (EvAAL-ETRI), metres."""


class ErrorQuantiles(Record):
    """Errors of scans, metres; None without any."""

    scans: int
    mean_m: float | None = None
    median_m: float | None = None
    p75_m: float | None = None
    p95_m: float | None = None
    rmse_m: float | None = None
    max_m: float | None = None


class Score(Record):
    """Figures of one model on one test part."""

    scans: int
    """All scans of the test part."""
    answered: float
    """Share of them that the model did not call unknown, 0 to 1; all other figures are over those."""
    floor_hit: float | None
    """Share on the right floor (and in the right building)."""
    building_hit: float | None
    plane: ErrorQuantiles
    """Error in the plane, whatever the floor."""
    plane_on_floor: ErrorQuantiles
    """The same of scans on the right floor."""
    space: ErrorQuantiles
    """Error in space, where heights are known."""
    ipin_m: float | None
    """Third quartile of the error in the plane plus 15 m for each floor off (50 m for a wrong building)."""
    inside_68: float | None
    """Share of true places inside the stated 68 % circle; None if none is stated."""
    inside_95: float | None


def plane_error_m(found: Positions, truth: ScanPlaces) -> FloatArray:
    """(n,) distance in the plane; NaN if the answer is unknown."""
    return truth.distance_m(found.xy)


def score(found: Positions, truth: ScanPlaces) -> Score:
    """Compare positions (n) with the truth (n); the truth's storeys must be the model's.

    Raises ValueError if they are not.
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
    """Reduce errors (n,) to figures; those that are not finite are left out."""
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
    """(n,) what wrong floors and buildings cost, metres."""
    floors_off = np.abs(found.floor - truth.floor)
    return np.asarray(FLOOR_PENALTY_M * floors_off + np.where(same_building, 0.0, BUILDING_PENALTY_M))


def _buildings(found: Positions) -> FloatArray:
    """(storeys,) a number for each storey's building."""
    names = [storey.building for storey in found.storeys]
    return np.array([names.index(name) for name in names])


def _inside(error_m: FloatArray, radius_m: FloatArray) -> float | None:
    """Share of errors (n,) within radii (n,); None if none is stated."""
    stated = np.isfinite(radius_m) & np.isfinite(error_m)
    return _share(error_m[stated] <= radius_m[stated])


def _share(hits: BoolArray) -> float | None:
    """Share of hits (n,); None of none."""
    return float(hits.mean()) if len(hits) else None


CANDIDATES = ("weighted-knn", "local-kriging", "cell-density")
"""Tried in this order, the quickest first."""
BUDGET_S = 300.0
_FOLDS = 5
_PROBED_WITH = 300
"""A model learns so many scans first, to tell how long all will take."""
_SEED = 0


@dataclass(frozen=True)
class TriedModel:
    """A model in cross-validation over walks."""

    name: str
    mean_m: float
    """Mean error in the plane, metres; NaN if it was not tried."""
    floor_hit: float
    score_m: float
    """Mean error and 15 m for each scan on a wrong floor: the least is chosen."""
    behind_m: tuple[float, float] | None
    """95 % interval, over walks, of how much greater its score is than the chosen one's; None for few walks."""
    why: str
    """In words, why it was chosen, or not."""


@dataclass(frozen=True)
class ModelTrial:
    """All models that were tried, the chosen one first."""

    tried: tuple[TriedModel, ...]

    @property
    def chosen(self) -> TriedModel:
        """The best."""
        return self.tried[0]


@dataclass(frozen=True)
class _Outcome:
    """Answers to all held-out scans, fold after fold."""

    name: str
    error_m: FloatArray
    right: BoolArray

    @property
    def cost_m(self) -> FloatArray:
        """(n,) error and penalty of each scan."""
        return self.error_m + FLOOR_PENALTY_M * ~self.right

    def mean_cost_m(self) -> float:
        """Of all scans."""
        return float(self.cost_m.mean())


def tried_models(
    labelled: LabelledScans,
    budget_s: float = BUDGET_S,
    progress: Progress[float] = silent,
    clock: Callable[[], float] = time.monotonic,
    candidates: Sequence[str] = CANDIDATES,
) -> ModelTrial:
    """Cross-validate the candidates over walks, of data without walks over scans.

    One that would overrun the budget is left out, but never the first. Raises DatasetError if there are too few
    scans to leave any out.
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
    told = [_told(one, made[0], walks) for one in made]
    return ModelTrial((*told, *(_left_out(name) for name in too_long)))


def _expected_s(name: str, labelled: LabelledScans, most: int, clock: Callable[[], float]) -> float:
    """Tell by some of the scans how long a model learns ``most`` of them; of few scans nothing is expected."""
    scans, places = labelled
    probe = np.sort(np.random.default_rng(_SEED).permutation(len(scans))[:_PROBED_WITH])
    if len(probe) == len(scans):
        return 0.0
    started = clock()
    model_named(name).fit(scans[probe], places[probe])
    return (clock() - started) * most / len(probe)


def _outcome(name: str, found: Sequence[Positions], truth: Sequence[LabelledScans]) -> _Outcome:
    """Compare with the truth; a scan that is unknown errs by as much as the worst."""
    error_m = np.concatenate([plane_error_m(one, places) for one, (_, places) in zip(found, truth, strict=True)])
    right = np.concatenate([one.storey == places.storey for one, (_, places) in zip(found, truth, strict=True)])
    return _Outcome(name, np.where(np.isnan(error_m), np.nanmax(error_m), error_m), right)


def _told(one: _Outcome, chosen: _Outcome, walks: FloatArray) -> TriedModel:
    mean_m, score_m = float(one.error_m.mean()), one.mean_cost_m()
    why = "chosen: the best" if one is chosen else f"{score_m / chosen.mean_cost_m() - 1:.1%} worse"
    behind_m = None if one is chosen else mean_interval(one.cost_m - chosen.cost_m, walks)
    return TriedModel(one.name, mean_m, float(one.right.mean()), score_m, behind_m, why)


def _left_out(name: str) -> TriedModel:
    unknown = float("nan")
    return TriedModel(name, unknown, unknown, unknown, None, "not tried: takes longer than the time budget")
