"""Which model has the smallest error on walks that it did not learn from, within a time budget."""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from vislam2tag.common.error_statistics import mean_interval
from vislam2tag.common.errors import DatasetError
from vislam2tag.common.progress import Progress, silent
from vislam2tag.core.arrays import BoolArray, FloatArray
from vislam2tag.positioning.metrics import FLOOR_PENALTY_M, plane_error_m
from vislam2tag.positioning.places import LabelledScans, Positions, folds, walk_numbers
from vislam2tag.positioning.registry import model_named

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
    """Mean error in the plane, metres; NaN where it was not tried."""
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

    One that would overrun the budget is left out, but never the first. Raises DatasetError where there are too few
    scans to leave any out.
    """
    scans, places = labelled
    usable = (scans.heard > 0) & np.isfinite(places.xy).all(axis=1) & (places.storey >= 0)
    scans, places = scans[usable], places[usable]
    walk = walk_numbers(scans, places)
    parts = list(folds(walk, _FOLDS, _SEED))
    if not parts:
        raise DatasetError("one fingerprint alone tells nothing of models; name one by --model")
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
    return TriedModel(name, unknown, unknown, unknown, None, "not tried: longer than the time budget")
