"""The demonstration: simulate a survey, process it with each strategy, score the labels against the truth."""

from __future__ import annotations

import json
import shutil
from collections.abc import Callable
from dataclasses import asdict, dataclass
from pathlib import Path

import numpy as np
import polars as pl

from vislam2tag.core.arrays import FloatArray
from vislam2tag.errors import OutputError
from vislam2tag.evaluation.truth import errors_at_frames, read_truth
from vislam2tag.mapping import strategy_names
from vislam2tag.pipeline.run import process
from vislam2tag.pipeline.tables import TRAJECTORY, trajectory_of
from vislam2tag.results import SessionResult
from vislam2tag.settings import Settings
from vislam2tag.simulation.scenario import regular_survey
from vislam2tag.simulation.survey import simulate

SURVEY = "survey"


@dataclass(frozen=True)
class Score:
    """Label errors of a strategy at all camera frames, metres; each walk counts once."""

    strategy: str
    mean_m: float
    median_m: float
    p75_m: float
    p95_m: float
    max_m: float
    labelled_share: float


def run_demo(out: Path, *, jobs: int = 1, seed: int = 1, say: Callable[[str], None] = print) -> list[Score]:
    """Make ``out/survey``, ``out/STRATEGY`` for each strategy, ``out/scores.csv`` and ``.json``; return the scores.

    A survey that an earlier demonstration left in ``out`` is used again. Raises OutputError where ``out`` holds
    something else or cannot be written.
    """
    _make_survey(out, seed, say)
    scores = []
    for strategy in strategy_names():
        say(f"mapping and labelling with {strategy}")
        process(out / SURVEY, out / strategy, Settings(strategy=strategy), jobs=jobs)
        scores.append(score(out / SURVEY, out / strategy, strategy))
    table = pl.DataFrame([asdict(entry) for entry in scores])
    table.write_csv(out / "scores.csv", float_precision=4)
    (out / "scores.json").write_text(json.dumps(table.to_dicts(), indent=1) + "\n", encoding="utf-8")
    return scores


def _make_survey(out: Path, seed: int, say: Callable[[str], None]) -> None:
    if (out / SURVEY / "simulation.json").is_file():
        say(f"using the survey of an earlier demonstration in {out / SURVEY}")
        return
    partial = out / f"{SURVEY}.partial"
    if out.exists() and (not out.is_dir() or {path.name for path in out.iterdir()} - {partial.name}):
        raise OutputError(f"{out}: is not empty and holds no demonstration; name a new folder")
    say("simulating a survey: 2 floors, 2 phones, 8 walks of 2 minutes")
    shutil.rmtree(partial, ignore_errors=True)
    simulate(regular_survey(seed, floors=(0, 1), sessions=2, duration_s=120.0), partial)
    partial.rename(out / SURVEY)


def score(survey: Path, out: Path, strategy: str) -> Score:
    """Compare the trajectories in ``out`` with each session's ``truth.csv``; averages over the walks.

    Walks of which nothing is labelled count in the share only.
    """
    results = [SessionResult.model_validate_json(path.read_bytes()) for path in sorted(out.glob("sessions/*.json"))]
    errors = [_walk_errors(survey, out, result) for result in results]
    labelled = [walk[np.isfinite(walk)] for walk in errors]
    statistics = np.array([_statistics(walk) for walk in labelled if len(walk)]).reshape(-1, 5)
    mean, median, p75, p95, greatest = statistics.mean(axis=0) if len(statistics) else np.full(5, np.nan)
    share = float(np.mean([len(known) / max(len(walk), 1) for known, walk in zip(labelled, errors, strict=True)]))
    return Score(strategy, float(mean), float(median), float(p75), float(p95), float(greatest), share)


def _walk_errors(survey: Path, out: Path, result: SessionResult) -> FloatArray:
    truth = read_truth(survey / f"floor_{result.floor}" / result.device / result.session / "truth.csv")
    table = pl.read_parquet(out / TRAJECTORY / f"{result.slug}.parquet")
    return errors_at_frames(trajectory_of(table), truth)


def _statistics(errors_m: FloatArray) -> FloatArray:
    return np.append(errors_m.mean(), np.quantile(errors_m, (0.5, 0.75, 0.95, 1.0)))
