"""What two folders are compared by: data sets, labels that ``process`` wrote, or the published labelled layout."""

from __future__ import annotations

import json
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field
from pathlib import Path

import polars as pl

from vislam2tag.common.errors import UsageError
from vislam2tag.common.files.plain_files import read_json
from vislam2tag.common.files.table_files import scan_parquet
from vislam2tag.dataset.annotated_tables import ANNOTATED_FILES, WIFI_FILE, read_annotated
from vislam2tag.dataset.by_session import one_session
from vislam2tag.dataset.folder import is_dataset, open_dataset
from vislam2tag.dataset.model import Dataset
from vislam2tag.dataset.schema import ACCESS_POINTS, FINGERPRINTS, IMU_WINDOWS, KEYS, MAGNETIC, READINGS, RTT, SESSIONS
from vislam2tag.labeling.results import PROGRAM, RESULTS, RUN_FILE
from vislam2tag.labeling.schemas import TRAJECTORY

DATASET, LABELS, ANNOTATED = "data set", "labels", "annotated files"
WHOLE_SET = ""
"""Stands for the session of tables that belong to none."""
_FACTS = {"floors", "frame", "clock", "groupings", "bssid_key"}
"""What of a manifest must be equal (of floors all but the file of the plan): the rest says who, when and how."""


@dataclass(frozen=True)
class ComparedTable:
    """One table of one session: its keys, and how it is read."""

    keys: tuple[str, ...]
    read: Callable[[], pl.DataFrame]


@dataclass(frozen=True)
class ComparedFolder:
    """What a folder holds, by session and table."""

    kind: str
    tables: Mapping[tuple[str, str], ComparedTable]
    facts: Mapping[str, str] = field(default_factory=dict)

    @property
    def sessions(self) -> set[str]:
        """Names of all sessions."""
        return {session for session, _ in self.tables} - {WHOLE_SET}


def comparable(folder: Path) -> ComparedFolder:
    """Look what a folder holds; raises UsageError where it is nothing that can be compared."""
    if is_dataset(folder):
        return _of_dataset(open_dataset(folder))
    if _is_output(folder):
        return ComparedFolder(LABELS, dict(_of_output(folder)))
    annotated = dict(_of_annotated(folder))
    if annotated:
        return ComparedFolder(ANNOTATED, annotated)
    raise UsageError(
        f"{folder}: holds nothing to compare; give data sets, outputs of `vislam2tag process`, or folders with "
        f"{' or '.join(ANNOTATED_FILES)} in their sessions"
    )


def _of_dataset(dataset: Dataset) -> ComparedFolder:
    facts = dataset.info.model_dump(mode="json", include=_FACTS, exclude={"floors": {"__all__": {"plan"}}})
    tables = dict(_session_parts(dataset))
    for name in (ACCESS_POINTS, SESSIONS):
        tables[WHOLE_SET, name] = ComparedTable((KEYS[name],), dataset.tables[name].collect)
    for name, split in dataset.splits.items():
        tables[WHOLE_SET, f"split {name}"] = ComparedTable(("id",), lambda groups=split.groups: groups)  # type: ignore[misc]
    return ComparedFolder(DATASET, tables, {name: json.dumps(value, sort_keys=True) for name, value in facts.items()})


def _session_parts(dataset: Dataset) -> Iterator[tuple[tuple[str, str], ComparedTable]]:
    sessions = dataset.fingerprints.select("session").unique().collect(engine="streaming")["session"]
    for session in sessions.sort():
        yield (session, FINGERPRINTS), ComparedTable((KEYS[FINGERPRINTS],), _rows_of(dataset, FINGERPRINTS, session))
        yield (session, READINGS), ComparedTable(("scan_id", "bssid", "time_ns"), _readings_of(dataset, session))
        for name in (MAGNETIC, IMU_WINDOWS, RTT):
            if name in dataset.tables:
                yield (session, name), ComparedTable((KEYS[name],), _rows_of(dataset, name, session))


def _rows_of(dataset: Dataset, name: str, session: str) -> Callable[[], pl.DataFrame]:
    return dataset.tables[name].filter(pl.col("session") == session).collect


def _readings_of(dataset: Dataset, session: str) -> Callable[[], pl.DataFrame]:
    return lambda: one_session(dataset.fingerprints, dataset.readings, session).readings


def _is_output(folder: Path) -> bool:
    try:
        return bool(read_json(folder / RUN_FILE)["program"] == PROGRAM)
    except (OSError, ValueError, KeyError, TypeError):
        return False


def _of_output(folder: Path) -> Iterator[tuple[tuple[str, str], ComparedTable]]:
    """Tables of the sessions that are done; readings are known by their line in the raw file, frames by their time."""
    for result in sorted((folder / RESULTS).glob("*.json")):
        for path in (table / f"{result.stem}.parquet" for table in sorted(folder.iterdir())):
            if not path.is_file():
                continue
            name = path.parent.name
            keys = ("time_ns",) if name == TRAJECTORY else ("row",)
            yield (result.stem, name), ComparedTable(keys, scan_parquet(path).collect)


def _of_annotated(folder: Path) -> Iterator[tuple[tuple[str, str], ComparedTable]]:
    for path in sorted(folder.rglob("*_annotated.csv")):
        if path.name in ANNOTATED_FILES:
            keys = ("time", "mac") if path.name == WIFI_FILE else ("time", "type")
            session = path.parent.relative_to(folder).as_posix()
            yield (session, path.name), ComparedTable(keys, lambda path=path: read_annotated(path))  # type: ignore[misc]
