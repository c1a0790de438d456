"""Functions that several formats share to write labels or labelled fingerprints.

Labels are shared without sessions that are links out of their survey. Fingerprints are yielded session by session, with
the parts of a split for formats with a training and a test file. Data for which a format has no place are counted and
reported, column by column.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterable, Iterator, Mapping
from contextlib import contextmanager
from itertools import chain, repeat
from pathlib import Path

import numpy as np
import numpy.typing as npt
import polars as pl

from vislam2tag.common.errors import DatasetError, UsageError
from vislam2tag.common.files.folder import Folder
from vislam2tag.common.findings import Finding, FindingKind, Severity, finding_if
from vislam2tag.common.progress import Progress
from vislam2tag.core.arrays import IntArray
from vislam2tag.datasets.folder import sha256_of
from vislam2tag.datasets.format_registry import ExportContext
from vislam2tag.datasets.labelled import LabelledSurvey, open_labelled, without_sessions
from vislam2tag.datasets.model import TEST, TRAIN, Dataset, Fold, SessionTables, Split, each_session
from vislam2tag.datasets.technologies import instead_of
from vislam2tag.labeling.results import SessionResult
from vislam2tag.sessions.registry import slugs_from_outside
from vislam2tag.site.links import left_out_sessions
from vislam2tag.site.model import SessionKey, SessionRef


def shared_labels(labels: Path, context: ExportContext) -> tuple[LabelledSurvey, tuple[Finding, ...]]:
    """Open labels in order to share them, and count what is skipped.

    Raises DatasetError as :func:`open_labelled` does, and SurveyError if the context's survey is invalid.
    """
    opened = open_labelled(labels, follow_links=context.follow_links)
    if context.survey is not None and not context.follow_links:
        opened = without_sessions(opened, slugs_from_outside(context.survey))
    if not opened.left_out:
        return opened, ()
    context.tell([left_out_sessions(opened.left_out, named=True)])
    return opened, (left_out_sessions(opened.left_out, named=False),)


def raw_session(refs: Mapping[SessionKey, SessionRef], result: SessionResult, survey: Path) -> SessionRef:
    """The session of a survey that labels were made from; raises UsageError if the survey does not contain it."""
    key = SessionKey(result.floor, result.device, result.session)
    if key not in refs:
        raise UsageError(f"--survey {survey}: no session {key}; pass the survey that the labels were made from")
    return refs[key]


def refuse_changed_files(here: SessionRef, result: SessionResult, survey: Path) -> None:
    """Raise UsageError if a raw file of a session has changed since the labels were made."""
    # Poses in a file for each picture have one account together, which no file can be compared with.
    below = {file.name for file in here.folder.glob("*/**/*")}
    for account in result.files:
        file = here.folder / account.name
        own = account.role != "companion" and (file.is_file() or account.name not in below)
        if own and not (file.is_file() and sha256_of(file) == account.sha256):
            raise UsageError(
                f"--survey {survey}: {here.key}: {account.name} has changed since the labels were made; run "
                "`vislam2tag process` again"
            )


SET = "set"
"""Name, among tables, for what belongs to the data set as a whole."""
MANIFEST, SPLITS, ONE_SPLIT, PLANS = "manifest", "splits", "one split", "plans"
DERIVED: Mapping[str, frozenset[str]] = {
    "fingerprints": frozenset({"readings"}),
    "access_points": frozenset(
        {
            "radio",
            "readings",
            "fingerprints",
            "sessions",
            "floors",
            "strongest_dbm",
            "randomised",
            "mobile",
            "nomap",
        }
    ),
    "sessions": frozenset({"fingerprints"}),
}
"""Columns that follow from others: reading makes them again, so nothing is lost."""
Holds = Mapping[str, Collection[str]]


def left_out_of_dataset(dataset: Dataset, holds: Holds) -> tuple[Finding, ...]:
    """Report what a format does not support: columns with values by table, then parts of the whole data set."""
    return (*left_out(dataset.tables, holds), *_of_set(dataset, holds.get(SET, ())))


def left_out(tables: Mapping[str, pl.LazyFrame], holds: Holds) -> tuple[Finding, ...]:
    """Report, table by table, the columns with values that a format does not support; ``count`` is the number of
    rows."""
    found = (_of_table(name, table, holds.get(name, ())) for name, table in tables.items())
    return tuple(finding for finding in found if finding)


def _of_table(name: str, table: pl.LazyFrame, held: Collection[str]) -> Finding | None:
    schema = table.collect_schema()
    if not held:
        rows = int(table.select(pl.len()).collect(engine="streaming").item())
        return (
            _finding(name, rows, f"the table {name} is skipped, because the format has no place for it")
            if rows
            else None
        )
    missing = [column for column in schema if column not in held and column not in DERIVED.get(name, ())]
    if not missing:
        return None
    # An empty text, such as the name of the only building, contains nothing that could be lost.
    stated = {
        column: (pl.col(column) != "").fill_null(value=False)
        if schema[column] == pl.String
        else pl.col(column).is_not_null()
        for column in missing
    }
    counts = table.select(
        pl.any_horizontal(stated.values()).sum().alias("_rows"),
        *(test.any().alias(name) for name, test in stated.items()),
    )
    found = counts.collect(engine="streaming").row(0, named=True)
    lost = [column for column in missing if found[column]]
    return _finding(name, found["_rows"], f"columns of {name} are skipped: {', '.join(lost)}") if lost else None


def _of_set(dataset: Dataset, held: Collection[str]) -> list[Finding]:
    info = dataset.info
    stated = [name for name in ("title", "description", "licence", "creators", "doi") if getattr(info, name)]
    findings = []
    if stated and MANIFEST not in held:
        findings.append(_finding("manifest", len(stated), f"skipped fields of the manifest: {', '.join(stated)}"))
    others = len(dataset.splits) - (ONE_SPLIT in held)
    if SPLITS not in held and others > 0:
        which = "all splits but one" if ONE_SPLIT in held else "splits"
        findings.append(_finding("splits", others, f"{which} are skipped"))
    if dataset.files and PLANS not in held:
        findings.append(_finding("plans", len(dataset.files), "floor plans are skipped"))
    return findings


def _finding(file: str, count: int, message: str) -> Finding:
    return Finding(kind="left_out", file=file, count=count, message=message, severity=Severity.INFO)


def in_neither_part(fingerprints: pl.LazyFrame, part: pl.DataFrame) -> tuple[Finding, ...]:
    """Count the fingerprints that are in neither part of a split."""
    left = fingerprints.join(part.lazy(), on="scan_id", how="anti").select(pl.len())
    count = int(left.collect(engine="streaming").item())
    message = "fingerprints are in neither the training set nor the test set of the split"
    return finding_if(count, "in_neither_part", message)


def train_test_assignment(dataset: Dataset, context: ExportContext) -> tuple[pl.DataFrame, tuple[Finding, ...]]:
    """Return the parts of the chosen split and fold; by default those of the official one, or all for training.

    The table has the columns ``scan_id`` and ``part``; fingerprints in neither part have no row. Raises UsageError for
    an unknown split or fold, and if a split has several folds and none is chosen.
    """
    if context.split is None:
        return _without_choice(dataset, context)
    if context.split not in dataset.splits:
        there = ", ".join(dataset.splits) or "none"
        raise UsageError(f"--split {context.split}: the data set has no such split; its splits: {there}")
    split = dataset.splits[context.split]
    return _parts(split, _fold(split, context.fold)), ()


def _without_choice(dataset: Dataset, context: ExportContext) -> tuple[pl.DataFrame, tuple[Finding, ...]]:
    if context.fold is not None:
        raise UsageError(f"--fold {context.fold}: name the split of this fold with --split")
    official = [split for split in dataset.splits.values() if split.info.kind == "official"]
    if len(official) == 1 and len(official[0].info.folds) == 1:
        return _parts(official[0], official[0].info.folds[0]), ()
    ids = dataset.fingerprints.select("scan_id", part=pl.lit(TRAIN)).collect(engine="streaming")
    message = "no split was chosen (--split), so everything is training data" + (
        f"; available splits: {', '.join(dataset.splits)}" if dataset.splits else "; the data set has no splits"
    )
    return ids, finding_if(1, "no_split", message)


def _fold(split: Split, name: str | None) -> Fold:
    folds = split.info.folds
    if name is None and len(folds) == 1:
        return folds[0]
    there = ", ".join(fold.name for fold in folds)
    if name is None:
        raise UsageError(
            f"--split {split.info.name}: the split has {len(folds)} folds; choose one with --fold: {there}"
        )
    try:
        return split.fold(name)
    except KeyError as error:
        raise UsageError(f"--fold {name}: split {split.info.name} has no such fold; its folds: {there}") from error


def _parts(split: Split, fold: Fold) -> pl.DataFrame:
    train, test = split.train_test_ids(fold)
    return pl.concat(
        [pl.DataFrame({"scan_id": ids}).with_columns(part=pl.lit(name)) for ids, name in ((train, TRAIN), (test, TEST))]
    )


_CELLS_AT_ONCE = 4_000_000
"""Cells of a matrix in memory at once: 16 MB."""
_NS = 1_000_000_000
UNKNOWN_LEVELS = "readings without a level are skipped"
UNMAPPED = "sessions without a position are skipped"


def labelled_fingerprints(
    dataset: Dataset, technology: str | None = None, *, uncertain: bool = True
) -> tuple[pl.LazyFrame, tuple[Finding, ...]]:
    """Return the fingerprints with x, y and a floor, in order, and findings about the others.

    With ``technology`` only its fingerprints; without ``uncertain`` no uncertain ones, for formats that cannot store a
    sigma. Raises DatasetError if none is left.
    """
    known = pl.all_horizontal(pl.col("x", "y", "floor").is_not_null())
    wanted = pl.lit(value=True) if technology is None else pl.col("technology") == technology
    sure = pl.lit(value=True) if uncertain else pl.col("status") != "uncertain"
    counts = dataset.fingerprints.select(
        kept=(known & wanted & sure).sum(),
        unlabelled=(~known & wanted).sum(),
        unsure=(known & wanted & ~sure).sum(),
        other=(~wanted).sum(),
    ).collect(engine="streaming")
    kept, *lost = counts.row(0)
    if not kept:
        what = "fingerprint" if technology is None else f"{technology} fingerprint"
        if lost[1]:
            raise DatasetError(
                f"{dataset.info.name}: no {what} has a certain position, and this format cannot store a standard "
                "deviation; `dataset --max-sigma-m` sets the limit"
            )
        instead = "" if technology is None else instead_of(dataset, technology)
        raise DatasetError(f"{dataset.info.name}: no {what} has a position, and this format needs one{instead}")
    messages: tuple[tuple[FindingKind, str], ...] = (
        (
            "unlabelled_left_out",
            "fingerprints without a position are skipped, because the format has no place for them",
        ),
        (
            "uncertain_left_out",
            "uncertain fingerprints are skipped, because the format cannot store a standard deviation; "
            "`dataset --max-sigma-m` sets the limit",
        ),
        ("technology_left_out", f"fingerprints of technologies other than {technology} are skipped"),
    )
    return dataset.fingerprints.filter(known & wanted & sure), _counted(lost, messages)


def labelled_by_session(
    dataset: Dataset, fingerprints: pl.LazyFrame, progress: Progress[str]
) -> Iterator[SessionTables]:
    """Yield the fingerprints and their readings session by session; ``progress`` is called after each."""
    total = fingerprints.select(pl.col("session").n_unique()).collect(engine="streaming").item()
    for tables in each_session(fingerprints, dataset.readings):
        yield tables
        progress(tables.session, total)


def matrices(
    tables: SessionTables, transmitters: pl.Series, not_heard: float
) -> Iterator[tuple[pl.DataFrame, npt.NDArray[np.float32]]]:
    """Yield runs of fingerprints with their levels (rows, access points), dBm; ``not_heard`` if there is none.

    Columns follow ``transmitters`` (bssid). Several readings of one access point in a fingerprint are averaged.
    """
    columns = pl.DataFrame({"bssid": transmitters}).with_row_index("column")
    height = max(1, _CELLS_AT_ONCE // max(1, len(transmitters)))
    for rows in tables.fingerprints.iter_slices(height):
        cells = (
            tables.readings.join(rows.select("scan_id").with_row_index("row"), on="scan_id")
            .join(columns, on="bssid")
            .group_by("row", "column")
            .agg(pl.col("rssi_dbm").mean())
            .drop_nulls("rssi_dbm")
        )
        matrix = np.full((rows.height, len(transmitters)), not_heard, dtype=np.float32)
        matrix[cells["row"].to_numpy(), cells["column"].to_numpy()] = cells["rssi_dbm"].to_numpy()
        yield rows, matrix


def _counted(counts: Iterable[int], messages: Iterable[tuple[FindingKind, str]]) -> tuple[Finding, ...]:
    pairs = zip(counts, messages, strict=True)
    return tuple(finding for count, (kind, message) in pairs for finding in finding_if(count, kind, message))


def matrix_losses(readings: pl.DataFrame, not_heard: float) -> IntArray:
    """Count the readings that a matrix of levels cannot contain unchanged: unknown, hidden, several."""
    levels = pl.col("rssi_dbm")
    counts = readings.select(
        unknown=levels.is_null().sum(),
        hidden=(levels == not_heard).sum(),
        several=pl.len() - pl.struct("scan_id", "bssid").n_unique(),
    )
    return np.array(counts.row(0), dtype=np.int64)


def matrix_loss_findings(lost: IntArray, not_heard: float) -> tuple[Finding, ...]:
    """Report the sums of :func:`matrix_losses` over all sessions."""
    hidden = f"readings of {not_heard:g} dBm look like 'not heard', which the format writes as this level"
    messages: tuple[tuple[FindingKind, str], ...] = (
        ("unknown_levels_left_out", UNKNOWN_LEVELS),
        ("levels_left_out", hidden),
        (
            "readings_averaged",
            "repeated readings of an access point in one fingerprint are replaced by their mean",
        ),
    )
    return _counted(lost.tolist(), messages)


def with_unix_time(dataset: Dataset) -> pl.LazyFrame:
    """Return ``scan_id`` and ``unix_ns`` (start of the fingerprint, ns since 1970) of every fingerprint.

    On the boot clock, this is the session's start (as UTC) plus the time since its first fingerprint; null if unknown.
    """
    start = pl.col("start_ns")
    if dataset.info.clock == "unix":
        return dataset.fingerprints.select("scan_id", unix_ns=start)
    if dataset.info.clock == "none":
        return dataset.fingerprints.select("scan_id", unix_ns=pl.lit(None, dtype=pl.Int64))
    first = dataset.fingerprints.group_by("session").agg(first_ns=start.min())
    started = dataset.sessions.select("session", started_ns=pl.col("started").dt.epoch("us") * 1000)
    return (
        dataset.fingerprints.select("scan_id", "session", "start_ns")
        .join(first, on="session", how="left", maintain_order="left")
        .join(started, on="session", how="left", maintain_order="left")
        .select("scan_id", unix_ns=pl.col("started_ns") + start - pl.col("first_ns"))
    )


def seconds_text(time_ns: pl.Expr) -> pl.Expr:
    """Write whole nanoseconds as seconds, without loss of digits."""
    rest = (time_ns % _NS).cast(pl.String).str.zfill(9).str.strip_chars_end("0")
    whole = (time_ns // _NS).cast(pl.String)
    return pl.when(rest == "").then(whole).otherwise(pl.concat_str([whole, rest], separator="."))


@contextmanager
def csv_file(
    folder: Folder, name: str, separator: str = ",", null: str = ""
) -> Iterator[Callable[[pl.DataFrame], None]]:
    """Open a new CSV file and yield a function that appends a table to it; ``null`` is written for unknown values.

    All tables have the same columns; the first writes the header, even without rows.
    """
    with folder.writing(name) as file:
        heads = chain((True,), repeat(False))
        yield lambda table: table.write_csv(file, include_header=next(heads), separator=separator, null_value=null)
