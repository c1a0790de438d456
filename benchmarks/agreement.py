"""Agreement with the published program on its six sessions: the same frames, and how far apart at most.

python benchmarks/agreement.py
"""

from __future__ import annotations

import tempfile
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
from vislam2tag.sessions.model import Session
from vislam2tag.sessions.registry import open_survey, read_session

PUBLISHED = {
    "global": "coords_global_post",
    "global-affine": "coords_global_affine_post",
    "local": "coords_local_raw_post",
    "local-corrected": "coords_local_post",
}
"""The published program's file of each strategy."""


def main() -> None:
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


if __name__ == "__main__":
    main()
