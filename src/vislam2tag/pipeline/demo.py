"""The demonstration: simulate a survey, process it with each strategy, and evaluate the labels against the truth."""

from __future__ import annotations

import json
from collections.abc import Callable
from dataclasses import asdict
from pathlib import Path

import polars as pl

from vislam2tag.common.errors import OutputError
from vislam2tag.common.files.folder import Folder
from vislam2tag.common.files.given_files import AnyPath, read_bytes, read_json
from vislam2tag.common.files.table_files import read_parquet, write_csv
from vislam2tag.common.files.whole_output import output_errors, whole_folder, work_folder_of
from vislam2tag.core.arrays import FloatArray
from vislam2tag.estimation.strategy import strategies_for_poses
from vislam2tag.labeling.results import SessionResult
from vislam2tag.labeling.settings import ProcessSettings
from vislam2tag.labeling.tables import TRAJECTORY, trajectory_of
from vislam2tag.pipeline.labels.process import process
from vislam2tag.pipeline.run.keys import code_key, key_of
from vislam2tag.quality.evaluation.metrics import ErrorSummary, average, summarise
from vislam2tag.quality.evaluation.truth import errors_at_frames, read_truth
from vislam2tag.simulation.scenario import regular_survey
from vislam2tag.simulation.survey import simulate

SURVEY, KEY_FILE = "survey", "demo.json"


def run_demo(
    out: AnyPath, *, jobs: int = 1, seed: int = 1, say: Callable[[str], None] = print
) -> dict[str, ErrorSummary]:
    """Make ``out/survey``, ``out/STRATEGY`` for each strategy, and ``out/scores.csv`` and ``.json``.

    Returns the label errors at all camera frames by strategy. The survey of an earlier demonstration with this seed
    in ``out`` is reused. Raises OutputError if ``out`` contains something else or cannot be written.
    """
    out = Path(out)
    _make_survey(out, seed, say)
    scores = {}
    for strategy in strategies_for_poses():
        say(f"mapping and labelling with {strategy}")
        process(out / SURVEY, out / strategy, ProcessSettings(strategy=strategy), jobs=jobs)
        scores[strategy] = score(out / SURVEY, out / strategy)
    rows = [{"strategy": strategy} | asdict(errors) for strategy, errors in scores.items()]
    table = pl.DataFrame(rows).fill_nan(None)
    with output_errors(out):
        write_csv(table, Folder.at(out), "scores.csv", float_precision=4)
        Folder.at(out).write("scores.json", json.dumps(table.to_dicts(), indent=1) + "\n")
    return scores


def _make_survey(out: Path, seed: int, say: Callable[[str], None]) -> None:
    """Simulate the survey unless ``out`` has one with this seed and version of the simulator."""
    key = key_of(seed, code_key(simulate.__module__, regular_survey.__module__))
    if _key_of_survey(out) == key:
        say(f"using the survey of an earlier demonstration in {out / SURVEY}")
        return
    if out.exists() and not _holds_demonstration(out) and not _is_empty(out):
        raise OutputError(f"{out}: the folder is not empty and does not contain a demonstration; choose a new folder")
    say("simulating a survey: 2 floors, 2 phones, 8 walks of 2 minutes")
    with whole_folder(out / SURVEY, lambda _: _holds_demonstration(out)) as survey:
        simulate(regular_survey(seed, floors=(0, 1), sessions=2, duration_s=120.0), survey.path)
    with output_errors(out):
        Folder.at(out).write(KEY_FILE, json.dumps({"survey": key}) + "\n")


def _is_empty(out: Path) -> bool:
    """Whether this folder only contains an unfinished survey."""
    return out.is_dir() and {path.name for path in out.iterdir()} <= {work_folder_of(out / SURVEY).name}


def _holds_demonstration(out: Path) -> bool:
    return (out / SURVEY / "simulation.json").is_file()


def _key_of_survey(out: Path) -> str | None:
    """Seed and simulator of the survey in ``out``; None if there is none."""
    try:
        return str(read_json(out / KEY_FILE)["survey"]) if _holds_demonstration(out) else None
    except (OSError, ValueError, KeyError, TypeError):
        return None


def score(survey: Path, out: Path) -> ErrorSummary:
    """Compare the trajectories in ``out`` with each session's ``truth.csv``; each walk counts once."""
    results = [SessionResult.model_validate_json(read_bytes(path)) for path in sorted(out.glob("sessions/*.json"))]
    return average([summarise(_walk_errors(survey, out, result)) for result in results])


def _walk_errors(survey: Path, out: Path, result: SessionResult) -> FloatArray:
    truth = read_truth(survey / f"floor_{result.floor}" / result.device / result.session / "truth.csv")
    table = read_parquet(out / TRAJECTORY / f"{result.slug}.parquet")
    return errors_at_frames(trajectory_of(table), truth)
