"""Reads the output of ``process`` one session at a time: results as JSON, tables as Parquet.

See docs/reference/output.md.
"""

from __future__ import annotations

from collections.abc import Collection, Iterable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass, replace
from pathlib import Path

import polars as pl
from pydantic import ValidationError

from vislam2tag.common.errors import DatasetError, first_line
from vislam2tag.common.files.folder import Folder
from vislam2tag.common.files.given_files import read_bytes, read_json
from vislam2tag.common.files.store import Store, store_at
from vislam2tag.common.files.stored_folder import outline_at_hand, outline_of, place_for
from vislam2tag.common.files.table_files import scan_parquet
from vislam2tag.common.files.whole_output import restore
from vislam2tag.common.folder_kinds import SURVEY, kind_of, survey_around
from vislam2tag.common.records import Record
from vislam2tag.labeling.results import PROGRAM, RESULTS, RUN_FILE, SUMMARY_FILE, FloorRecord, SessionResult
from vislam2tag.labeling.tables import SCHEMAS
from vislam2tag.site.links import CURE, outside_link

RUN_LABELS = "labels"
"""Folder of the labels in the output of ``run``."""
_AGAIN = "run `vislam2tag process` again"


class _RunFile(Record, extra="ignore"):
    """The relevant part of ``run.json``."""

    program: str
    survey: str
    floors: tuple[FloorRecord, ...]
    settings: dict[str, object]
    versions: dict[str, str]
    building: str = ""
    site_from_outside: bool = False
    rebase: tuple[dict[str, object], ...] = ()


class _Origin(Record, extra="ignore"):
    """The relevant part of a session's result before it is read."""

    from_outside: bool = False


@dataclass(frozen=True)
class LabelledSession:
    """One session of an output folder of ``process``."""

    root: Path
    slug: str
    store: Store | None = None
    """Location of the files; ``root`` then contains only their names."""

    @contextmanager
    def at_hand(self) -> Iterator[LabelledSession]:
        """Yield the session with its files on this machine while the block runs; raises StoreError."""
        if self.store is None:
            yield self
            return
        with place_for(self.store) as root:
            tables = [self._path(table).relative_to(self.root) for table in SCHEMAS if self.has(table)]
            for name in (f"{RESULTS}/{self.slug}.json", *(table.as_posix() for table in tables)):
                self.store.fetch(name, Folder(root), name)
            yield LabelledSession(root, self.slug)

    def result(self) -> SessionResult:
        """Read the session's result without its tables; raises DatasetError if it cannot be read."""
        path = self.root / RESULTS / f"{self.slug}.json"
        try:
            return SessionResult.model_validate_json(read_bytes(path))
        except (OSError, ValidationError) as error:
            raise DatasetError(f"{path}: cannot be read ({first_line(error)}); {_AGAIN}") from error

    def is_from_outside(self) -> bool:
        """Whether its raw files are links out of the survey, or its labels are links out of their folder.

        Raises DatasetError if its result cannot be read.
        """
        result = self.root / RESULTS / f"{self.slug}.json"
        if any(outside_link(self.root, path) for path in (result, *(self._path(table) for table in SCHEMAS))):
            return True
        try:
            stored = None if self.store is None else self.store.get(result.relative_to(self.root).as_posix())
            return _Origin.model_validate_json(stored.data if stored else read_bytes(result)).from_outside
        except (OSError, ValidationError) as error:
            raise DatasetError(f"{result}: cannot be read ({first_line(error)}); {_AGAIN}") from error

    def has(self, table: str) -> bool:
        """Whether the session has this table; tables that not every phone logs may be missing."""
        return self._path(table).is_file()

    def table(self, table: str, columns: Iterable[str], only: pl.Expr | None = None) -> pl.DataFrame:
        """Read columns of a table (:data:`vislam2tag.labeling.tables.SCHEMAS`), with the rows that ``only`` selects.

        Raises DatasetError if the file is missing or damaged, or has no such column.
        """
        path = self._path(table)
        wanted = list(columns)
        try:
            rows = scan_parquet(path)
            found = rows.collect_schema()
            for column in wanted:
                if found.get(column) != SCHEMAS[table][column]:
                    raise DatasetError(f"{path}: column {column} is missing or not {SCHEMAS[table][column]}; {_AGAIN}")
            return (rows if only is None else rows.filter(only)).select(wanted).collect()
        except (OSError, pl.exceptions.PolarsError) as error:
            raise DatasetError(f"{path}: cannot be read ({first_line(error)}); {_AGAIN}") from error

    def unknown_columns(self, table: str) -> list[str]:
        """Columns of a table that ``process`` does not write and no command reads."""
        return [name for name in scan_parquet(self._path(table)).collect_schema() if name not in SCHEMAS[table]]

    def _path(self, table: str) -> Path:
        return self.root / table / f"{self.slug}.parquet"


@dataclass(frozen=True)
class LabelledSurvey:
    """An output folder of ``process``, opened but not read."""

    root: Path
    survey: str
    """Name of the survey's folder."""
    floors: tuple[FloorRecord, ...]
    settings: Mapping[str, object]
    version: str
    sessions: tuple[LabelledSession, ...]
    """Sorted by slug."""
    rebase: tuple[Mapping[str, object], ...] = ()
    """Changes of frame that were applied to the labels, in order (docs/how-to/site.md)."""
    building: str = ""
    """Name of the building in ``site.toml``; empty if unknown."""
    left_out: tuple[str, ...] = ()
    """Slugs of the sessions that are not in ``sessions``, because they are links out of the survey."""

    @property
    def max_sigma_m(self) -> float:
        """The sigma above which ``process`` marked a position as uncertain, metres."""
        labels = self.settings.get("labels")
        return float(labels["max_sigma_m"]) if isinstance(labels, dict) and "max_sigma_m" in labels else float("inf")


@contextmanager
def labels_at_hand(labels: Path) -> Iterator[Path]:
    """Yield a local folder for labels at an address while the block runs; local folders are yielded unchanged.

    Sessions' files exist by name only (:meth:`LabelledSession.at_hand`). Raises StoreError if the store cannot be read.
    """
    store = store_at(labels)
    if store is None:
        yield labels
        return
    with outline_at_hand(store, lambda root: filter(Path.exists, (root / RUN_FILE, root / SUMMARY_FILE))) as root:
        yield root


def labels_in(folder: Path) -> Path:
    """The output folder of ``process``: the given one, or the labels in the output of ``run``."""
    inner = folder / RUN_LABELS
    return inner if (inner / RUN_FILE).is_file() else folder


def is_labelled(folder: Path) -> bool:
    """Whether the folder is an output folder of ``process`` or ``run``, finished or not."""
    restore(folder)
    return (folder / RUN_FILE).is_file()


def open_labelled(root: Path, *, follow_links: bool = False) -> LabelledSurvey:
    """Open an output folder of ``process`` or ``run``, without links out of the survey unless ``follow_links``.

    Raises DatasetError if it is not one, if its last run has not finished, or if it contains no session.
    """
    root = labels_in(root)
    restore(root)  # undoes a rebase that was killed before it had written anything
    run = _run(root)
    if not (root / SUMMARY_FILE).is_file():
        raise DatasetError(f"{root}: `vislam2tag process` has not finished writing it; run it again, and it continues")
    stored = outline_of(root)
    store = None if stored is None else stored.store
    sessions = tuple(LabelledSession(root, path.stem, store) for path in sorted((root / RESULTS).glob("*.json")))
    if not sessions:
        raise DatasetError(f"{root}: contains no session; process a survey that has sessions")
    opened = LabelledSurvey(
        root, run.survey, run.floors, run.settings, run.versions.get(PROGRAM, ""), sessions, run.rebase, run.building
    )
    return opened if follow_links else _shared(opened, run.site_from_outside)


def _shared(opened: LabelledSurvey, site_from_outside: bool) -> LabelledSurvey:
    """Labels without links out of the survey: sessions, and names and georeferences of floors."""
    if (link := outside_link(opened.root, opened.root / RUN_FILE)) is not None:
        raise DatasetError(f"{opened.root / link}: a link to a file outside the labels; {CURE}")
    outside = tuple(session.slug for session in opened.sessions if session.is_from_outside())
    if site_from_outside:
        floors = (
            floor.model_copy(update={"name": f"Floor {floor.number}", "georeference": None}) for floor in opened.floors
        )
        opened = replace(opened, floors=tuple(floors), building="")
    return without_sessions(opened, outside)


def without_sessions(opened: LabelledSurvey, outside: Collection[str]) -> LabelledSurvey:
    """Remove sessions that are links out of their survey, by slug; raises DatasetError if none remains."""
    kept = tuple(session for session in opened.sessions if session.slug not in outside)
    gone = tuple(session.slug for session in opened.sessions if session.slug in outside)
    if not kept:
        raise DatasetError(
            f"{opened.root}: the files of all {len(gone)} sessions are links to files outside the survey, so no "
            "session "
            f"remains: {', '.join(gone)}; {CURE}"
        )
    return replace(opened, sessions=kept, left_out=(*opened.left_out, *gone))


def labels_instead(root: Path) -> str:
    """What to pass instead of a folder that has no labels."""
    kind = kind_of(root)
    if kind == SURVEY:
        return f"it is a survey, so first run `vislam2tag process {root} --out labels`, and pass labels"
    if survey := survey_around(root):
        return f"it is {kind}: run `vislam2tag process {survey} --out labels`, and pass labels"
    said = f"it is {kind}; " if kind else ""
    return f"{said}pass the folder that was the --out of `vislam2tag process` or `vislam2tag run`"


def _run(root: Path) -> _RunFile:
    path = root / RUN_FILE
    try:
        content = read_json(path)
        if not isinstance(content, dict) or content.get("program") != PROGRAM:
            raise DatasetError(f"{root}: not written by `vislam2tag process`; {labels_instead(root)}")
        return _RunFile.model_validate(content)
    except OSError as error:
        raise DatasetError(
            f"{root}: not an output folder of `vislam2tag process` ({RUN_FILE} cannot be read: {error.strerror}); "
            f"{labels_instead(root)}"
        ) from error
    except ValidationError as error:
        field = ".".join(map(str, error.errors()[0]["loc"]))
        raise DatasetError(f"{path}: no usable '{field}', perhaps from an earlier version; {_AGAIN}") from error
    except ValueError as error:
        raise DatasetError(f"{path}: the file is damaged ({first_line(error)}); {_AGAIN}") from error
