"""Output folders for labels, on this machine or in a store: claimed for a run, or refused for what they hold."""

from __future__ import annotations

import json
from collections.abc import Iterable, Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from vislam2tag.common.errors import OutputError
from vislam2tag.common.files.own_files import OwnFiles
from vislam2tag.common.files.plain_files import read_json
from vislam2tag.common.files.store import shown, store_at
from vislam2tag.labeling.results import CONFLICTS_FILE, CONFLICTS_PAGE, PROGRAM, RUN_FILE, SUMMARY_FILE, SessionResult
from vislam2tag.labeling.settings import ProcessSettings
from vislam2tag.pipeline.run.keys import key_of
from vislam2tag.pipeline.run.output_store import LOGS, REPORT_FILE, OutputStore, claim_store
from vislam2tag.pipeline.run.store import SESSION_FOLDERS, OutputFolder, claim
from vislam2tag.site.frame_change import CHANGE_FILE

_OF_RUN = (SUMMARY_FILE, REPORT_FILE, CONFLICTS_PAGE, CONFLICTS_FILE, CHANGE_FILE)


def output_at(out: Path) -> OutputFolder | OutputStore:
    """An output folder for labels, which is not claimed: to read it."""
    store = store_at(out)
    return OutputFolder(out) if store is None else OutputStore(store)


@contextmanager
def claimed(
    out: Path, record: dict[str, object], slugs: Iterable[str], replace: bool, *, keep_summary: bool = False
) -> Iterator[OutputFolder | OutputStore]:
    """Claim an output for labels of sessions, named by their slugs; raises OutputError and StoreError.

    The summary of an earlier run is removed. With ``keep_summary`` it stays if that run's record was the same.
    """
    store, own = store_at(out), OwnFiles.of(_OF_RUN, (*SESSION_FOLDERS, LOGS), slugs)
    if store is None:
        with claim(out, record, own=own, replace=replace, keep_summary=keep_summary) as folder:
            yield folder
    else:
        with claim_store(store, record, own, replace=replace, keep_summary=keep_summary) as stored:
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


def refuse_mixed_settings(out: Path, settings: ProcessSettings, left_out: Sequence[str]) -> None:
    """Raise OutputError if ``out`` contains results of sessions that a run leaves out, of other settings than its own.

    Results of labels that were rebased count as such: they are in another frame.
    """
    if not left_out:
        return
    try:
        run = _run_of(out)
        before, rebased = dict(run["settings"]), bool(run.get("rebase"))
    except (OSError, ValueError, KeyError, TypeError, AttributeError):
        before, rebased = {}, False
    now = settings.of_labels()
    other = [result for result in output_at(out).results(left_out) if rebased or _of_other_settings(result, now)]
    if not other:
        return
    names = [] if rebased else sorted(name for name in now if name in before and before[name] != now[name])
    if rebased:
        why = "labels that `vislam2tag site rebase` made"
    else:
        why = "results of other settings" + (f" ({', '.join(names)})" if names else "")
    more = f" and {len(other) - 1} more" if len(other) > 1 else ""
    raise OutputError(
        f"{shown(out)}: contains {why} for {other[0].slug}{more}, which --floor or --device leave out, and one output "
        "never mixes settings; run without --floor and --device, or choose another --out"
    )


def _of_other_settings(result: SessionResult, now: dict[str, object]) -> bool:
    return result.strategy != now["strategy"] or result.parts.get("settings", key_of(now)) != key_of(now)


def _run_of(out: Path) -> Any:
    """The record of the run that wrote an output folder; raises OSError or ValueError where none can be read."""
    store = store_at(out)
    if store is None:
        return read_json(out / RUN_FILE)
    found = store.get(RUN_FILE)
    return None if found is None else json.loads(found.data)
