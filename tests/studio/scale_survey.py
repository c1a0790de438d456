"""A labelled survey as large as the studio must bear: 100 sessions of 30,000 frames, made of three short walks.

``python -m tests.studio.scale_survey FOLDER`` writes FOLDER/survey and FOLDER/labels. Each session is one of the walks,
to and fro until it is long enough, moved by up to a metre; its raw files are those of the short walk.
"""

from __future__ import annotations

import json
import os
import sys
from datetime import datetime, timedelta
from pathlib import Path

import numpy as np
import polars as pl

from tests.surveys import make_survey
from vislam2tag.common.files.folder import Folder
from vislam2tag.core.status import counts_by_label
from vislam2tag.labeling.results import SessionResult
from vislam2tag.labeling.tables import status_codes, write_table
from vislam2tag.pipeline.labels.process import process
from vislam2tag.site.model import SessionKey, session_slugs

SESSIONS, FRAMES, FLOORS, DEVICES = 100, 30_000, 3, 5
FIRST = datetime(2022, 1, 10, 9)
APART_NS = 33_333_333


def write_scale_survey(folder: Path, sessions: int = SESSIONS, frames: int = FRAMES) -> None:
    """Write the survey and its labels."""
    survey, labels = folder / "survey", folder / "labels"
    make_survey(survey, floors=FLOORS, devices=("LG",), seconds=120.0)
    process(survey, labels)
    bases = [SessionResult.model_validate_json(path.read_bytes()) for path in sorted(labels.glob("sessions/*.json"))]
    for number in range(sessions):
        base = bases[number % FLOORS]
        start = FIRST + timedelta(days=number // DEVICES, minutes=20 * (number % DEVICES))
        key = SessionKey(base.floor, f"Phone{number % DEVICES}", start.isoformat())
        _link_files(survey, base, key)
        _write_labels(labels, base, key, number, frames)
    for base in bases:
        for path in labels.glob(f"*/{base.slug}.*"):
            path.unlink()
        for path in sorted((survey / f"floor_{base.floor}" / base.device).rglob("*"), reverse=True):
            path.rmdir() if path.is_dir() else path.unlink()
        (survey / f"floor_{base.floor}" / base.device).rmdir()


def _link_files(survey: Path, base: SessionResult, key: SessionKey) -> None:
    target = survey / f"floor_{key.floor}" / key.device / key.session
    target.mkdir(parents=True)
    for file in (survey / f"floor_{base.floor}" / base.device / base.session).iterdir():
        os.link(file, target / file.name)


def _write_labels(labels: Path, base: SessionResult, key: SessionKey, number: int, frames: int) -> None:
    (slug,) = session_slugs([key])
    names = {"device": pl.lit(key.device), "session": pl.lit(key.session)}
    shift = np.random.default_rng(number).uniform(-1, 1, 2)
    once = pl.read_parquet(labels / "trajectory" / f"{base.slug}.parquet")
    rounds = -(-frames // len(once))
    table = pl.concat([once if part % 2 == 0 else once.reverse() for part in range(rounds)]).head(frames)
    time_ns = int(once["time_ns"][0]) + np.arange(frames, dtype=np.int64) * APART_NS
    table = table.with_columns(pl.Series("time_ns", time_ns), pl.col("x") + shift[0], pl.col("y") + shift[1], **names)
    write_table(table, "trajectory", base.strategy, Folder.at(labels), f"trajectory/{slug}.parquet")
    for name in ("wifi", "sensors"):
        readings = pl.read_parquet(labels / name / f"{base.slug}.parquet").with_columns(**names)
        write_table(readings, name, base.strategy, Folder.at(labels), f"{name}/{slug}.parquet")
    counts = counts_by_label(status_codes(table))
    result = base.model_copy(
        update={
            "slug": slug,
            "device": key.device,
            "session": key.session,
            "frames": counts,
            "start_ns": int(time_ns[0]),
            "duration_s": round(float(time_ns[-1] - time_ns[0]) * 1e-9, 3),
        }
    )
    (labels / "sessions" / f"{slug}.json").write_text(json.dumps(result.model_dump(mode="json")), encoding="utf-8")


if __name__ == "__main__":
    write_scale_survey(Path(sys.argv[1]))
