"""Output folders for labels, on this machine or in a store: claimed for a run, or refused for what they hold."""

from __future__ import annotations

import json
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from vislam2tag.common.errors import OutputError
from vislam2tag.common.files.plain_files import read_json
from vislam2tag.common.files.store import shown, store_at
from vislam2tag.labeling.results import PROGRAM, RUN_FILE
from vislam2tag.pipeline.run.output_store import OutputStore, claim_store
from vislam2tag.pipeline.run.store import OutputFolder, claim


@contextmanager
def claimed(
    out: Path, record: dict[str, object], replace: bool, *, keep_summary: bool = False
) -> Iterator[OutputFolder | OutputStore]:
    """Claim an output for one run; raises OutputError and StoreError where it cannot be.

    The summary of an earlier run is removed. With ``keep_summary`` it stays if that run's record was the same.
    """
    store = store_at(out)
    if store is None:
        with claim(out, record, replace=replace, keep_summary=keep_summary) as folder:
            yield folder
    else:
        with claim_store(store, record, replace=replace, keep_summary=keep_summary) as stored:
            yield stored


def refuse_other_labels(out: Path, strategy: str) -> None:
    """Raise OutputError where ``out`` holds labels that this strategy did not make."""
    try:
        run = _run_of(out)
        ours = run["program"] == PROGRAM
        before = str(run["settings"]["strategy"])
        rebased = bool(run.get("rebase"))
    except (OSError, ValueError, KeyError, TypeError, AttributeError):
        return
    if ours and (rebased or before != strategy):
        what = "labels that `vislam2tag site rebase` made" if rebased else f"labels of the strategy {before}"
        raise OutputError(
            f"{shown(out)}: holds {what}; give --replace to replace them by labels of {strategy}, "
            "or choose another --out"
        )


def _run_of(out: Path) -> Any:
    """The record of the run that wrote an output folder; raises OSError or ValueError where none can be read."""
    store = store_at(out)
    if store is None:
        return read_json(out / RUN_FILE)
    found = store.get(RUN_FILE)
    return None if found is None else json.loads(found.data)
