"""Copies raw surveys into a fleet, without removing files or silently overwriting them.

``sources/SURVEY.json`` records the origin of a survey and the SHA-256 of each of its files. It is written conditionally
before the first file is copied, so that two programs cannot fill the same survey, and again after the last. A folder
counts as the same survey as one in the fleet if it contains all of its files unchanged, or at least one complete
session. Other folders are refused.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence, Set
from dataclasses import dataclass
from pathlib import Path, PurePosixPath

from pydantic import ValidationError

from vislam2tag.common.errors import StoreConflictError, SurveyError, UsageError
from vislam2tag.common.files.folder import Folder, scratch_folder
from vislam2tag.common.files.store import Listed, Version, shown
from vislam2tag.common.files.stored_folder import AnyStore, FolderStore, any_store_at, is_safe_name
from vislam2tag.common.records import Record
from vislam2tag.datasets.folder import sha256_of
from vislam2tag.pipeline.fleet.catalogue import REPLACED, SOURCES, SURVEYS
from vislam2tag.sessions.registry import open_survey
from vislam2tag.site.stored_survey import survey_at_hand

_FETCHED = "file"


class AddedSurvey(Record):
    """Changes by adding a survey to a fleet, as names of files."""

    survey: str
    """Its name in the fleet."""
    added: tuple[str, ...] = ()
    unchanged: tuple[str, ...] = ()
    replaced: tuple[str, ...] = ()
    """The former versions are kept in ``replaced/SURVEY``."""
    left_alone: tuple[str, ...] = ()
    """Files of the fleet that the added folder does not contain."""


class RawFile(Record):
    """A file of a survey as it was added."""

    sha256: str
    mark: str = ""
    """Mark of the version in the fleet from a listing; empty until the file is copied."""


class Source(Record):
    """Origin of a survey of a fleet."""

    survey: str
    source: str
    files: dict[str, RawFile]


@dataclass(frozen=True)
class RawCopy:
    """A survey that can be copied into a fleet."""

    fleet: Path
    survey: Path
    changes: AddedSurvey
    record: Source
    """Record while files are copied."""
    before: Version | None
    """Version of the record that this one replaces."""

    @property
    def _target(self) -> AnyStore:
        return any_store_at(self.fleet / SURVEYS / self.changes.survey)

    def carry_out(self) -> AddedSurvey:
        """Copy new files; return the changes.

        Raises SurveyError if a file is removed meanwhile, StoreConflictError if another program adds to the survey,
        OutputError and StoreError if a file cannot be read or written.
        """
        claimed = self._write(self.record, self.before)
        if not self.changes.added and not self.changes.replaced:
            return self.changes
        copied = {}
        with scratch_folder() as scratch:
            for name in self.changes.replaced:
                self._keep_former(name, scratch)
            for name in (*self.changes.added, *self.changes.replaced):
                file = _fetched(any_store_at(self.survey), name, scratch)
                self._target.put(name, file)
                copied[name] = sha256_of(file)
        marks = {file.name: file.version.mark for file in _files(self._target)}
        new = {name: RawFile(sha256=sha256, mark=marks.get(name, "")) for name, sha256 in copied.items()}
        self._write(self.record.model_copy(update={"files": self.record.files | new}), claimed)
        return self.changes

    def _keep_former(self, name: str, scratch: Folder) -> None:
        """Keep the version of a file that is about to be replaced, once per content."""
        file = _fetched(self._target, name, scratch)
        kept = f"{REPLACED}/{self.changes.survey}/{name}/{sha256_of(file)}{PurePosixPath(name).suffix}"
        any_store_at(self.fleet).put(kept, file)

    def _write(self, record: Source, before: Version | None) -> Version:
        """Write the record over the earlier version; return the new version."""
        name, store = _record_name(record.survey), any_store_at(self.fleet)
        content = (record.model_dump_json(indent=1) + "\n").encode()
        try:
            store.put_over(name, content, before)
            found = store.get(name)
            if found is None or found.data != content:
                raise StoreConflictError(name)
        except StoreConflictError:
            raise StoreConflictError(
                f"{shown(self.fleet)}: another program is adding to the survey {record.survey}; run the same command "
                "again when it has ended"
            ) from None
        return found.version


def planned_copy(fleet: Path, survey: Path, name: str, *, replace: bool, left_out: Set[str] = frozenset()) -> RawCopy:
    """Compare a survey with the one of that name in a fleet, without writing.

    ``left_out`` names files and folders of the survey that are not to be copied. Raises SurveyError if it is not a
    survey, UsageError if it differs from the survey in the fleet, or if files differ without ``replace``, StoreError
    if a store cannot be read.
    """
    sessions = _raw_of_sessions(survey)
    source, target = any_store_at(survey), any_store_at(fleet / SURVEYS / name)
    record, version = _record_of(fleet, name)
    known = record.files if record is not None else {}
    with scratch_folder() as scratch:
        copied = [one.name for one in _files(source) if not _is_below(one.name, left_out)]
        given = {one: RawFile(sha256=_sha256(source, one, scratch)) for one in copied}
        there = {one.name: _in_fleet(target, one, known.get(one.name), scratch) for one in _files(target)}
    expected = known | there
    shared = {one for one in expected if one in given and given[one].sha256 == expected[one].sha256}
    differing = sorted(one for one in there if one in given and one not in shared)
    is_same = shared == expected.keys() or any(_is_whole(session, given.keys(), shared) for session in sessions)
    if not replace and (differing or not is_same):
        origin = record.source if record is not None else shown(fleet / SURVEYS / name)
        raise _refusal(shown(survey), name, origin, differing, f"{shown(fleet)}/{REPLACED}/{name}")
    unchanged = {one: there[one] for one in sorted(shared & there.keys())}
    changes = AddedSurvey(
        survey=name,
        added=tuple(sorted(given.keys() - there.keys())),
        unchanged=tuple(unchanged),
        replaced=tuple(differing),
        left_alone=tuple(sorted(there.keys() - given.keys())),
    )
    files = known | given | unchanged
    return RawCopy(fleet, survey, changes, Source(survey=name, source=shown(survey), files=files), version)


def _raw_of_sessions(survey: Path) -> list[PurePosixPath]:
    """Relative paths of the raw sessions of a survey: folders or single files."""
    with survey_at_hand(survey) as root:
        opened = open_survey(root)
        return [PurePosixPath((ref.packed or ref.folder).relative_to(opened.root)) for ref in opened.sessions]


def _is_whole(session: PurePosixPath, given: Set[str], shared: Set[str]) -> bool:
    """Whether all files of a session are shared, and there are any."""
    files = {name for name in given if session in (PurePosixPath(name), *PurePosixPath(name).parents)}
    return bool(files) and files <= shared


def _in_fleet(target: AnyStore, file: Listed, known: RawFile | None, scratch: Folder) -> RawFile:
    """A file in the fleet, which is only read if it has changed since it was copied."""
    if known is not None and known.mark == file.version.mark != "":
        return known
    return RawFile(sha256=_sha256(target, file.name, scratch), mark=file.version.mark)


def _sha256(store: AnyStore, name: str, scratch: Folder) -> str:
    if isinstance(store, FolderStore):
        return sha256_of(store.root / name)
    return sha256_of(_fetched(store, name, scratch))


def _fetched(store: AnyStore, name: str, scratch: Folder) -> Path:
    """Fetch a listed file over the earlier one; raises SurveyError if it no longer exists."""
    scratch.remove(_FETCHED)
    store.fetch(name, scratch, _FETCHED)
    if not (scratch / _FETCHED).is_file():
        raise SurveyError(f"{store.address}/{name}: the file no longer exists; run the same command again")
    return scratch / _FETCHED


def _is_below(name: str, folders: Set[str]) -> bool:
    """Whether a file is one of these, or in one of them."""
    return any(str(part) in folders for part in (PurePosixPath(name), *PurePosixPath(name).parents))


def _files(store: AnyStore) -> Iterator[Listed]:
    return (file for file in store.list() if is_safe_name(file.name))


def _record_name(survey: str) -> str:
    return f"{SOURCES}/{survey}.json"


def _record_of(fleet: Path, survey: str) -> tuple[Source | None, Version | None]:
    """Origin of a survey of a fleet, if known, and the version of its record."""
    found = any_store_at(fleet).get(_record_name(survey))
    if found is None:
        return None, None
    try:
        return Source.model_validate_json(found.data), found.version
    except ValidationError as error:
        place = f"{shown(fleet)}/{_record_name(survey)}"
        raise UsageError(
            f"{place}: the file is damaged or from a later version; remove it and run the same command again, which "
            "then reads the files of the fleet instead"
        ) from error


def _refusal(survey: str, name: str, origin: str, differing: Sequence[str], kept: str) -> UsageError:
    if differing:
        more = f" and {len(differing) - 1} more" if len(differing) > 1 else ""
        what = f"{differing[0]}{more} differ from the files"
    else:
        what = "has no session in common with those"
    return UsageError(
        f"{survey}: {what} of the survey {name} in the fleet, which was added from {origin}. If it is another survey, "
        f"use --name NAME. If it is the same, use --replace: this replaces files that differ and keeps the former "
        f"versions in {kept}"
    )
