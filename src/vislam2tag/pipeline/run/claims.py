"""Claims output folders for one run, or refuses them because of their contents.

A folder on this machine is locked. Object stores have no locks: several programs may write at once if their runs are
the same, and the record of the run, ``run.json``, is written conditionally.
"""

from __future__ import annotations

import json
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path, PurePosixPath
from typing import Any

from vislam2tag.common.errors import OutputError, StoreConflictError, StoreError
from vislam2tag.common.files.atomic import only_one
from vislam2tag.common.files.folder import UNFINISHED, Folder, scratch_folder
from vislam2tag.common.files.given_files import json_values
from vislam2tag.common.files.own_files import OWN_FILES, OwnFiles, owned_files, without_record
from vislam2tag.common.files.store import PROBE, Store, Stored, shown
from vislam2tag.common.files.whole_output import files_below
from vislam2tag.common.folder_kinds import written_by
from vislam2tag.datasets.folder import MANIFEST, refuse_unless_replaced
from vislam2tag.labeling.results import CONFLICTS_FILE, CONFLICTS_PAGE, PROGRAM, RUN_FILE, SUMMARY_FILE, SessionResult
from vislam2tag.labeling.settings import ProcessSettings
from vislam2tag.pipeline.run.failures import LOG_FILE, logged_to
from vislam2tag.pipeline.run.keys import key_of
from vislam2tag.pipeline.run.output import REPORT_FILE, OutputFolder

LOCK = ".lock"
OF_RUN = (SUMMARY_FILE, REPORT_FILE, CONFLICTS_PAGE, CONFLICTS_FILE)
"""Files that a run of ``process`` writes last."""
_OF_EVERY_RUN = OwnFiles.of([RUN_FILE, LOG_FILE])


@contextmanager
def claim(
    root: Path,
    run: dict[str, object],
    program: str = PROGRAM,
    own: OwnFiles | None = None,
    *,
    replace: bool | None = None,
    keep_summary: bool = False,
) -> Iterator[OutputFolder]:
    """Open an output folder for one run: new, empty or of the same ``program``. Raises OutputError otherwise.

    ``own`` names the files that the run may write in addition to those of every run; they are recorded as ours. With
    ``replace`` the files of another command are removed first, according to its record; None: they are never replaced.
    With ``keep_summary`` the summary of an earlier run stays if that run's record was the same. Raises StoreError if a
    store cannot be written or has no conditional writes, OutputError if a run of other settings took it meanwhile.
    """
    folder = OutputFolder(root)
    content = (json.dumps({"program": program} | run, indent=2, sort_keys=True) + "\n").encode()
    mine = (own or OwnFiles()).with_those_of(_OF_EVERY_RUN)
    store = folder.at
    if isinstance(store, Store):
        claimed = _claimed_in_store(folder, store, content, mine, replace=bool(replace), keep_summary=keep_summary)
    else:
        claimed = _claimed_here(folder, program, content, mine, replace=replace, keep_summary=keep_summary)
    with claimed:
        yield folder


@contextmanager
def _claimed_here(
    output: OutputFolder, program: str, content: bytes, own: OwnFiles, *, replace: bool | None, keep_summary: bool
) -> Iterator[None]:
    root = output.root
    folder = Folder.at(root)
    try:
        folder.make()
        _refuse_foreign(root, program, replace)
    except OSError as error:
        reason = "a file, not a folder" if root.is_file() else error.strerror
        raise OutputError(f"{root}: cannot be used as the output folder ({reason}); choose another --out") from error
    with only_one(folder, LOCK, f"{root}: another run is writing to this folder; wait for it or choose another --out"):
        if _refuse_foreign(root, program, replace):
            _empty(output)
        before = _content(output)
        if not (keep_summary and before == content):
            output.discard(*OF_RUN, LOG_FILE)
        others = OwnFiles() if before is None else output.own()  # without a run, none of its files exist
        output.change_own(lambda _: own.with_those_of(others))
        output.put_text(RUN_FILE, content.decode())
        with logged_to(folder):
            yield


def _refuse_foreign(root: Path, program: str, replace: bool | None) -> bool:
    """Refuse a non-empty folder that none of our commands wrote, or without a record of its files.

    Return whether another command of ours wrote it.
    """
    there = {path.name for path in root.iterdir() if not UNFINISHED.fullmatch(path.name)}
    if there <= {LOCK, OWN_FILES}:
        return False
    maker = written_by(root)
    if maker is None:
        # A record without run and files is from a command that was killed before writing or after removing the rest.
        if OWN_FILES in there and not there & {RUN_FILE, MANIFEST} and _owned(root) <= {LOCK, OWN_FILES}:
            return False
        raise OutputError(
            f"{root}: the folder is not empty and {program} did not create it (it has no {RUN_FILE} of that command); "
            "choose an empty or new folder for --out"
        )
    of_another = maker != (f"{PROGRAM} process" if program == PROGRAM else program)
    if of_another and replace is None:
        raise OutputError(
            f"{root}: the folder contains files of `{maker}`, which other commands never replace; choose another --out"
        )
    if of_another:
        refuse_unless_replaced(root, maker, bool(replace))
    if OwnFiles.read(root) is None:
        raise without_record(str(root))
    return of_another


def _owned(root: Path) -> set[str]:
    return owned_files(files_below(root), lambda name: OwnFiles.read((root / name).parent))


def _empty(output: OutputFolder) -> None:
    """Remove the files in a folder's record except the record itself; the record of the run is removed last."""
    root = output.root
    for name in sorted(_owned(root) - {OWN_FILES}, key=lambda name: (name in (RUN_FILE, MANIFEST), name)):
        output.remove(name)
        for folder in list(PurePosixPath(name).parents)[:-1]:
            Folder.at(root).folder(folder.as_posix()).remove_if_empty()


@contextmanager
def _claimed_in_store(
    output: OutputFolder, store: Store, content: bytes, own: OwnFiles, *, replace: bool, keep_summary: bool
) -> Iterator[None]:
    store.refuse_without_conditional_writes()
    before = _run_of_ours(output, store) or _emptied(output, store, replace)
    record = output.own()
    stale = [name for name in (*OF_RUN, LOG_FILE) if record.owns(name)]
    output.change_own(own.with_those_of)
    taken = OutputError(
        f"{store.address}: a run with other settings is writing to this folder; wait for it or choose another --out"
    )
    is_recorded = before is not None and before.data == content
    if not is_recorded:
        try:
            store.put_over(RUN_FILE, content, None if before is None else before.version)
        except StoreConflictError:
            if _content(output) != content:
                raise taken from None
    if not (keep_summary and is_recorded):
        store.delete(stale)
    with scratch_folder() as scratch:
        log = scratch / LOG_FILE
        try:
            with logged_to(scratch):
                yield
        finally:
            if log.exists():
                store.put(LOG_FILE, log)
    if _content(output) != content:
        raise taken


def _content(output: OutputFolder) -> bytes | None:
    found = output.at.get(RUN_FILE)
    return None if found is None else found.data


def _run_of_ours(output: OutputFolder, store: Store) -> Stored | None:
    """The run of ``process`` that wrote a folder in a store; raises OutputError for one without a record."""
    found = store.get(RUN_FILE)
    if found is None or _program(found.data) != PROGRAM:
        return None
    if output.own_version()[0] is None:
        raise without_record(store.address)
    return found


def _program(data: bytes) -> str | None:
    try:
        return str(json.loads(data)["program"])
    except (ValueError, KeyError, TypeError):
        return None


def _emptied(output: OutputFolder, store: Store, replace: bool) -> Stored | None:
    """Refuse a folder that `process` did not write, or remove its recorded files; return a run that has begun since."""
    files = [
        file.name for file in store.list() if not file.name.startswith(PROBE)
    ]  # others may be starting at the same time
    if not {*files} - {OWN_FILES}:
        return None
    if (begun := _run_of_ours(output, store)) is not None:
        return begun
    own, _ = output.own_version()
    owned = set() if own is None else {name for name in files if own.owns(name)}
    # It was killed before writing or after removing everything else.
    if RUN_FILE not in files and own is not None and owned <= {OWN_FILES}:
        return None
    if own is None or not replace or any(name.startswith("floor_") for name in files):
        raise OutputError(
            f"{store.address}: the folder is not empty and `{PROGRAM} process` did not create it (it contains "
            f"{files[0]}); choose an empty or new folder for --out"
        )
    store.delete(name for name in files if own.owns(name) and name not in (OWN_FILES, RUN_FILE))
    store.delete([RUN_FILE])
    output.change_own(lambda _: OwnFiles())
    return None


def refuse_other_labels(out: Path, strategy: str) -> None:
    """Raise OutputError if ``out`` contains labels of another strategy."""
    try:
        run = _run_of(out)
        ours = run["program"] == PROGRAM
        before = str(run["settings"]["strategy"])
        rebased = bool(run.get("rebase"))
    except (ValueError, KeyError, TypeError, AttributeError):
        return
    if ours and (rebased or before != strategy):
        what = "labels from `vislam2tag site rebase`" if rebased else f"labels of the strategy {before}"
        raise OutputError(
            f"{shown(out)}: the folder contains {what}; use --replace to replace them by labels of {strategy}, "
            "or choose another --out"
        )


def refuse_mixed_settings(out: Path, settings: ProcessSettings, left_out: Sequence[str]) -> None:
    """Raise OutputError if ``out`` contains results with other settings of sessions outside the run's selection.

    Rebased labels count as such, because they are in another frame.
    """
    if not left_out:
        return
    try:
        run = _run_of(out)
        before, rebased = dict(run["settings"]), bool(run.get("rebase"))
    except (ValueError, KeyError, TypeError, AttributeError):
        before, rebased = {}, False
    now = settings.of_labels()
    other = [result for result in OutputFolder(out).results(left_out) if rebased or _of_other_settings(result, now)]
    if not other:
        return
    names = [] if rebased else sorted(name for name in now if name in before and before[name] != now[name])
    if rebased:
        why = "labels that `vislam2tag site rebase` made"
    else:
        why = "results of other settings" + (f" ({', '.join(names)})" if names else "")
    more = f" and {len(other) - 1} more" if len(other) > 1 else ""
    raise OutputError(
        f"{shown(out)}: the folder contains {why} for {other[0].slug}{more}, which --floor or --device exclude. One "
        "output never mixes settings; run without --floor and --device, or choose another --out"
    )


def _of_other_settings(result: SessionResult, now: dict[str, object]) -> bool:
    return result.strategy != now["strategy"] or result.parts.get("settings", key_of(now)) != key_of(now)


def kept_together(out: Path, settings: ProcessSettings) -> ProcessSettings:
    """The settings, with ``together`` if ``out`` contains labels of this strategy that were mapped together."""
    try:
        before = dict(_run_of(out)["settings"])
    except (ValueError, KeyError, TypeError, AttributeError):
        return settings
    together = settings.together or (bool(before.get("together")) and before.get("strategy") == settings.strategy)
    return settings.model_copy(update={"together": together})


def _run_of(out: Path) -> Any:
    """The record of the run that wrote an output folder, None without one; raises ValueError for a damaged one."""
    output = OutputFolder(out)
    try:
        content = _content(output)
    except StoreError:
        if output.in_store:
            raise
        return None
    return None if content is None else json_values(content)
