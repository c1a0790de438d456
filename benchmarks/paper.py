"""Published results compared with those of this program: the published program's output, and the paper's tables.

``agreement`` compares the published program's six sessions: common frames, and the largest distance. ``tables`` makes
Tables I and II from generated copies of the paper's evaluation, one for each seed. Each copy is written as a raw survey
and read back: 24 walks over control points, 10 in view of a total station. Every figure is printed next to the paper's.
The last columns are its median over the seeds as a multiple of the paper's, and the number of seeds within a factor of
1.5.

    python benchmarks/paper.py agreement
    python benchmarks/paper.py tables                    seeds 1 to 5
    python benchmarks/paper.py tables --seeds 11 12 13
"""

from __future__ import annotations

import argparse
import statistics
import tempfile
from collections.abc import Callable, Mapping
from pathlib import Path

import numpy as np
import polars as pl
from data_sets import extract_agreement, landmarks_on

from vislam2tag.core.status import has_position
from vislam2tag.core.tracks import Trajectory
from vislam2tag.estimation.settings import MappingSettings
from vislam2tag.estimation.strategy import strategy_named
from vislam2tag.labeling.settings import LabelRule, LabelSettings
from vislam2tag.labeling.tables import label_readings
from vislam2tag.pipeline.paper.data import open_paper_data, paper_walks
from vislam2tag.quality.evaluation.paper import (
    PAPER_TABLE_1,
    PAPER_TABLE_1_NON_FAULTY,
    PAPER_TABLE_2,
    WalkErrors,
    WalkSummary,
    summarise_walks,
)
from vislam2tag.sessions.model import Session
from vislam2tag.sessions.registry import open_survey, read_session
from vislam2tag.settings import Settings
from vislam2tag.simulation.scenario import paper_evaluation
from vislam2tag.simulation.survey import simulate

PUBLISHED = {
    "global": "coords_global_post",
    "global-affine": "coords_global_affine_post",
    "local": "coords_local_raw_post",
    "local-corrected": "coords_local_post",
}
"""The published program's file of each strategy."""
FACTOR = 1.5
Walks = list[WalkErrors]
Triple = tuple[float, float, float]


def main() -> None:
    """Print the tables of the subcommand."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    what = parser.add_subparsers(dest="what", required=True)
    what.add_parser("agreement", help="with the published program")
    tables = what.add_parser("tables", help="beside the published ones")
    tables.add_argument("--seeds", type=int, nargs="+", default=[1, 2, 3, 4, 5])
    tables.add_argument("--severity", default="default")
    options = parser.parse_args()
    if options.what == "agreement":
        print_agreement()
    else:
        print_tables(options.seeds, options.severity)


def print_agreement() -> None:
    """Print the frames mapped by both programs and their greatest distance, then the same of the readings."""
    with tempfile.TemporaryDirectory() as folder:
        root = extract_agreement(Path(folder))
        if root is None:
            print("the agreement data are not beside this checkout")
            return
        frames = pl.DataFrame(compare_all(root))
    print(as_markdown(frames.filter(pl.col("of").is_in(list(PUBLISHED))), "mapped frames"))
    print(as_markdown(frames.filter(~pl.col("of").is_in(list(PUBLISHED))), "annotated rows"))


def compare_all(root: Path) -> list[dict[str, object]]:
    """Compare each session's frames by strategy and its annotated rows by table."""
    survey = open_survey(root / "raw")
    rows = []
    for ref in survey.sessions:
        session = read_session(ref)
        folder = root / "published-output" / ref.folder.relative_to(root / "raw")
        for strategy, stem in PUBLISHED.items():
            landmarks = landmarks_on(survey, ref.key.floor)
            trajectory = strategy_named(strategy, MappingSettings()).map(session.camera, session.landmarks, landmarks)
            rows.append({"of": strategy, **compare_frames(trajectory, folder, stem)})
            if strategy == "local-corrected":
                rows += [
                    {"of": name, **compare_rows(session, name, trajectory, folder / f"{name}_annotated.csv")}
                    for name in session.tables
                    if (folder / f"{name}_annotated.csv").is_file()
                ]
    return rows


def compare_frames(trajectory: Trajectory, folder: Path, stem: str) -> dict[str, float]:
    """Count the frames that both map or only one, and find the greatest distance in metres."""
    position = np.genfromtxt(folder / f"{stem}.csv", delimiter=",").reshape(-1, 2)
    time_ns = np.round(np.genfromtxt(folder / f"{stem}_time.csv")).astype(np.int64)
    theirs = np.isfinite(position).all(axis=1)
    ours = has_position(trajectory.status)
    _, at_ours, at_theirs = np.intersect1d(trajectory.time_ns[ours], time_ns[theirs], return_indices=True)
    apart = np.linalg.norm(trajectory.position_bcs[ours][at_ours, :2] - position[theirs][at_theirs], axis=1)
    both = len(at_ours)
    return {"both": both, "one": int(ours.sum() + theirs.sum()) - 2 * both, "greatest_m": float(apart.max(initial=0))}


def compare_rows(session: Session, name: str, trajectory: Trajectory, file: Path) -> dict[str, float]:
    """Count the annotated rows that agree on having a label or do not, and find the greatest distance in metres."""
    published = pl.read_csv(file).with_columns(pl.col("x_coord", "y_coord").cast(pl.Float64))
    readings = session.tables[name].with_columns(repeated=pl.lit(value=False))  # the published program keeps repeats
    labelled = label_readings(readings, trajectory, LabelSettings(rule=LabelRule.NEXT_FRAME))
    ours = labelled.filter(pl.col("time_ns").is_in(published["time"].implode())).sort("time_ns", maintain_order=True)
    apart = np.linalg.norm(ours.select("x", "y").to_numpy() - published.select("x_coord", "y_coord").to_numpy(), axis=1)
    differing = int((ours["x"].is_null().to_numpy() != published["x_coord"].is_null().to_numpy()).sum())
    differing += labelled["x"].count() - ours["x"].count()  # labelled by us, left out by the published program
    return {"both": len(ours) - differing, "one": differing, "greatest_m": float(np.nanmax(apart, initial=0))}


def as_markdown(compared: pl.DataFrame, what: str) -> str:
    """One line for each strategy or table."""
    lines = [f"\n| {what} | sessions | agree | differ | greatest distance, mm |", "| --- " * 5 + "|"]
    for (name,), rows in compared.group_by("of", maintain_order=True):
        both, one, greatest = rows["both"].sum(), rows["one"].sum(), rows.select(pl.max("greatest_m")).item()
        lines.append(f"| {name} | {len(rows)} | {both} | {one} | {1000 * greatest:.4f} |")
    return "\n".join(lines)


def print_tables(seeds: list[int], severity: str) -> None:
    """Simulate and evaluate one copy a seed, then print both tables."""
    copies = [evaluate_copy(seed, severity) for seed in seeds]
    pressed, tracked = [copy[0] for copy in copies], [copy[1] for copy in copies]
    print_table("Table I, all walks", seeds, PAPER_TABLE_1, pressed, summarise_walks)
    print_table("Table I, non-faulty walks", seeds, PAPER_TABLE_1_NON_FAULTY, pressed, over_non_faulty)
    print_table("Table II, total station", seeds, PAPER_TABLE_2, tracked, summarise_walks)


def evaluate_copy(seed: int, severity: str) -> tuple[Walks, Walks]:
    """Write one copy of the paper's evaluation, read it back and evaluate it."""
    with tempfile.TemporaryDirectory() as folder:
        root = Path(folder) / "survey"
        simulate(paper_evaluation(seed, severity), root)
        found = paper_walks(open_paper_data(root), Settings())
    return [walk.errors for walk in found.pressed], [walk.errors for walk in found.tracked]


def over_non_faulty(walks: Walks, strategy: str) -> WalkSummary:
    """Reduce the walks from which ``local-corrected`` discards nothing."""
    return summarise_walks([walk for walk in walks if not walk.faulty], strategy)


def print_table(
    title: str,
    seeds: list[int],
    paper: Mapping[str, Triple],
    copies: list[Walks],
    reduce: Callable[[Walks, str], WalkSummary],
) -> None:
    """Print one table as Markdown: a row for each strategy and statistic."""
    print(f"\n{title} (metres)\n")
    heads = [f"seed {seed}" for seed in seeds]
    print("| strategy | over walks | paper |", " | ".join(heads), "| median / paper | within 1.5 |")
    print("| --- " * (len(seeds) + 5) + "|")
    for strategy, published in paper.items():
        rows = [reduce(walks, strategy) for walks in copies]
        found = ([r.mean_m for r in rows], [r.median_m for r in rows], [r.max_m for r in rows])
        for name, value, values in zip(("mean", "median", "maximum"), published, found, strict=True):
            near = sum(1 / FACTOR <= one / value <= FACTOR for one in values)
            cells = " | ".join(f"{one:.2f}" for one in values)
            ratio = statistics.median(values) / value
            print(f"| {strategy} | {name} | {value:.2f} | {cells} | {ratio:.2f} | {near} of {len(values)} |")


if __name__ == "__main__":
    main()
