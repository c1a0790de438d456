"""The protocol of session formats and their registry; adding a format touches one module of this package."""

from __future__ import annotations

import hashlib
import os
from collections.abc import Iterator, Sequence
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Protocol

import polars as pl

from vislam2tag.common import plugins
from vislam2tag.common.errors import DatasetError, SessionError, SurveyError, first_line
from vislam2tag.common.files.archives import zip_heads, zip_names
from vislam2tag.common.files.folder import Folder, scratch_folder
from vislam2tag.common.files.given_files import AnyPath, path_or_none, read_bytes
from vislam2tag.common.files.store import at_once
from vislam2tag.common.findings import Finding, FindingKind, Severity
from vislam2tag.common.plugins import Registry
from vislam2tag.sessions.companion_ties import FOLDER as COMPANIONS
from vislam2tag.sessions.companion_ties import companion_hashes, tied_recordings
from vislam2tag.sessions.model import Session
from vislam2tag.sessions.session_files import named_alike, unpacked
from vislam2tag.sessions.settings import FindingSettings
from vislam2tag.site.corrections.file import CORRECTIONS_FILE, Corrections, read_corrections
from vislam2tag.site.corrections.landmarks import with_control_points_corrected
from vislam2tag.site.corrections.unknown import unused_corrections
from vislam2tag.site.discover import landmarks_off_plan, read_site, session_folders, walks_twice, zip_of
from vislam2tag.site.landmark_states import planned_findings
from vislam2tag.site.links import is_from_outside
from vislam2tag.site.model import SessionKey, SessionRef, Site, StoredFolder, Survey, session_slugs
from vislam2tag.site.settings import SurveySettings
from vislam2tag.site.site_file import has_site_file
from vislam2tag.site.site_table import site_finding
from vislam2tag.site.stored_survey import opened, stored_folder, with_stored_plans

_MOST_NAMES = 5000
"""Of a zip that is looked into; a recording has a file a frame at most."""
_MOST_HEADS = 100
TABLE_SUFFIXES, HEAD_BYTES = frozenset({".csv", ".tsv", ".txt"}), 2000
"""Tables of a folder by whose first bytes a format may recognise it."""
_UNRECOGNISED: FindingKind = "unrecognised_folder"
UNKNOWN_FORMAT = "unknown"
"""Format of a session folder that cannot be looked into; reading it raises SessionError."""


class SessionFormat(Protocol):
    """Reads the session folders of one raw format."""

    @property
    def name(self) -> str:
        """By which a survey, a plug-in and messages call the format."""
        ...

    def recognises(self, folder: Path) -> bool:
        """Return, from the names in a folder and the first bytes of tables, whether it is a session of this format.

        Of tables (:data:`TABLE_SUFFIXES`) no more than :data:`HEAD_BYTES` bytes may be there.

        Raises OSError where the folder cannot be looked into.
        """
        ...

    def input_files(self, folder: Path) -> list[Path]:
        """List the files of a session folder that :meth:`read` looks at."""
        ...

    def read(self, ref: SessionRef, settings: FindingSettings) -> Session:
        """Read a session whole; data problems are findings, only a SessionError may escape."""
        ...


FORMATS: Registry[SessionFormat] = Registry(plugins.SESSION_FORMATS)


def register(session_format: SessionFormat) -> None:
    """Make a format known by its name; called once at the end of the format's own module."""
    FORMATS.add(session_format.name, session_format)


def format_of(folder: Path) -> str | None:
    """Name of the first format, in order of names, that recognises a folder; None where none does.

    :data:`UNKNOWN_FORMAT` where the folder cannot be looked into.
    """
    try:
        return next((name for name, known in FORMATS.all().items() if known.recognises(folder)), None)
    except OSError:
        return UNKNOWN_FORMAT


def recorded_folder(folder: Path) -> Path:
    """The folder itself, or the one folder within that an app packed its recording in."""
    inside = [each for each in folder.iterdir() if not each.name.startswith((".", "__MACOSX"))]
    return inside[0] if len(inside) == 1 and inside[0].is_dir() and format_of(folder) is None else folder


def format_in_zip(root: Path, packed: Path) -> str | None:
    """Name of the format that would recognise what a zip in a survey unpacks to; None: none does.

    It is recognised by the names of its files and the first lines of its tables.

    Raises DatasetError or OSError where the zip cannot be listed.
    """
    with opened(root, packed) as file:
        names = zip_names(file)[:_MOST_NAMES]
        heads = zip_heads(file, TABLE_SUFFIXES, HEAD_BYTES, _MOST_HEADS)
    with named_alike(names, heads) as folder:
        found = format_of(recorded_folder(folder))
        return None if found == UNKNOWN_FORMAT else found


def format_module(name: str) -> str:
    """Name of the module that a session format is written in; this one for a format that is none."""
    if name in plugins.SESSION_FORMATS.built_in:
        return plugins.SESSION_FORMATS.built_in[name]
    return type(FORMATS.named(name)).__module__ if name in FORMATS.names() else __name__


def hash_inputs(ref: SessionRef) -> dict[str, str]:
    """SHA-256 of each input file of a session and its companions by name; raises SessionError where one is not read."""
    with _readable(ref) as here:
        paths = format_for(here).input_files(here.folder)
        own = {path.name: hashlib.sha256(read_bytes(path)).hexdigest() for path in paths}
        return own | companion_hashes(here.own)


def read_session(ref: SessionRef, settings: FindingSettings | None = None) -> Session:
    """Read one session whole. Raises SessionError where its folder or format is gone; nothing else."""
    with _readable(ref) as here:
        return format_for(here).read(here, settings or FindingSettings())


def read_track(ref: SessionRef, settings: FindingSettings | None = None) -> Session:
    """Read of a session what its map follows from: whole where it has no poses, or its format knows no shorter way.

    The shorter way is a format's ``read_track``, which reads poses, landmarks, air pressure and what the collector
    entered; tables may then be empty, and findings are left out. Raises as :func:`read_session`.
    """
    with _readable(ref) as here:
        known, settings = format_for(here), settings or FindingSettings()
        if (shorter := getattr(known, "read_track", None)) is not None:
            session: Session = shorter(here, settings)
            if session.camera.usable.any():
                return session
        return known.read(here, settings)


@contextmanager
def _readable(ref: SessionRef) -> Iterator[SessionRef]:
    """Yield a session at hand; what of its files cannot be read while the block lasts ends in a SessionError."""
    try:
        with at_hand(ref) as ref:
            yield ref
    except (OSError, pl.exceptions.PolarsError) as error:
        raise SessionError(f"{ref.folder}: cannot be read: {first_line(error)}") from error


@contextmanager
def at_hand(ref: SessionRef, *further: str, whole: bool = False) -> Iterator[SessionRef]:
    """Yield a session whose files are on this machine while the block lasts: one in a store is fetched, others stay.

    Fetched is what its format reads, its companions, and the ``further`` files that are there, by name; they lie as in
    the survey, so that paths from one to the other hold. Of one in a zip what its format reads is unpacked, or the
    ``whole`` of it.
    """
    with ExitStack() as stack:
        if ref.stored is not None:
            ref = _fetched(ref, ref.stored, stack.enter_context(scratch_folder()), further)
        if ref.packed is not None:
            scratch = stack.enter_context(scratch_folder())
            read = None if whole else FORMATS.named(ref.format).input_files
            ref = unpacked(ref, ref.packed, scratch, recorded_folder, read)
        yield ref


def _fetched(ref: SessionRef, stored: StoredFolder, scratch: Folder, further: Sequence[str]) -> SessionRef:
    """A session of a store with the files that are read, in ``scratch``."""
    folder = scratch / stored.name
    files = {scratch / file.name: file.name for file in stored.files}
    for name in files.values():
        scratch.create(name)
    packed = None if ref.packed is None else folder.parent / ref.packed.name
    here = replace(ref, folder=folder, stored=None, packed=packed)
    if packed is None:
        tied = {path for path in files if folder not in (path, *path.parents)}
        read = {*format_for(here).input_files(folder), *(folder / name for name in further), *tied}
        read |= {path for path in files if folder / COMPANIONS in path.parents}
    else:
        read = set(files)
    wanted = sorted(files.keys() & read)
    versions = at_once(lambda path: stored.store.fetch(files[path], scratch, files[path]), wanted)
    for path, version in zip(wanted, versions, strict=True):
        if version is None:
            scratch.remove(files[path])  # removed since the survey was listed
    return here


def format_for(ref: SessionRef) -> SessionFormat:
    """The format that reads a session at hand; raises SessionError where that or the session's files are not there."""
    if ref.format == UNKNOWN_FORMAT:
        raise SessionError(f"{ref.folder}: the folder cannot be opened; check its permissions")
    if ref.format not in FORMATS.names():
        raise SessionError(f"{ref.folder}: there is no session format '{ref.format}'")
    if ref.packed is not None:
        raise SessionError(
            f"{ref.packed}: cannot be unpacked: it is damaged or too large, or the disk is full; send it again, or "
            "replace it by the folder that it contains"
        )
    if not ref.folder.exists():
        raise SessionError(f"{ref.folder}: no such session folder")
    return FORMATS.named(ref.format)


@dataclass(frozen=True)
class SurveyFiles:
    """A survey folder, looked at but not read, before its corrections."""

    root: Path
    site: Site
    sessions: tuple[SessionRef, ...]
    """Sorted by key, which is by the names of the folder; without slugs, and not in a store."""
    findings: tuple[Finding, ...]
    odd_folders: tuple[Finding, ...]

    def corrected(self, corrections: Corrections, *, use_planned: bool = False) -> Survey:
        """The survey as corrections make it; raises SurveyError where they are wrong for it.

        Landmark positions that were only planned are unknown to it unless ``use_planned`` is given.
        """
        own = [found.key for found in self.sessions]
        keys = true_keys(own, corrections, self.site)
        unused = unused_corrections(corrections, [*keys, *own], self.site)
        refs = [
            replace(of, key=key, slug=slug, stored=stored_folder(self.root, of.folder, of.packed, tied_recordings))
            for key, of, slug in zip(keys, self.sessions, session_slugs(keys), strict=True)
        ]
        site = with_control_points_corrected(self.site, corrections)
        in_order = tuple(sorted(refs, key=lambda ref: ref.key))
        off_plan = landmarks_off_plan(site, corrections)
        planned = planned_findings(site.landmarks, use_planned=use_planned)
        if not use_planned:
            site = replace(site, landmarks=site.landmarks.without_planned_positions())
        return Survey(self.root, site, in_order, (*self.findings, *unused, *off_plan, *planned, *self.odd_folders))


def open_survey(
    root: AnyPath,
    default_sigma_m: float = SurveySettings().landmark_sigma_m,
    landmark_file: AnyPath | None = None,
    *,
    use_planned: bool = False,
) -> Survey:
    """Look at a survey folder: read the site's files, list the sessions, read none of them.

    ``default_sigma_m`` is the standard deviation per axis of landmarks whose file gives none; ``landmark_file``
    replaces the floors' own landmark files. Positions that were only planned are unknown unless ``use_planned`` is
    given. Raises SurveyError where the folder is missing, no folder, cannot be looked into, contains no floor or no
    session, or where ``corrections.toml`` or ``landmark_file`` is wrong.
    """
    root, landmark_file = Path(root), path_or_none(landmark_file)
    files = survey_files(root, default_sigma_m, landmark_file)
    return files.corrected(read_corrections(root), use_planned=use_planned)


def survey_files(
    root: Path, default_sigma_m: float, landmark_file: Path | None = None, *, walked: bool = True
) -> SurveyFiles:
    """Look at a survey folder without its corrections; raises SurveyError as :func:`open_survey`.

    Unless it has to be ``walked`` already, a folder without sessions will do.
    """
    try:
        site, findings = read_site(root, default_sigma_m, landmark_file, follow_links=True)
        site = with_stored_plans(site, root)
        sessions, odd_folders = _sessions(root)
    except OSError as error:
        raise SurveyError(f"{root}: the folder cannot be opened: {error}") from error
    if not sessions and walked:
        if has_site_file(root) and not odd_folders:
            raise SurveyError(f"{root}: contains no walks yet: record some, then run vislam2tag receive {root}")
        locked = [f"; {folder.file}: {folder.message}" for folder in odd_folders if folder.kind == "unreadable_folder"]
        raise SurveyError(
            f"{root}: this is not a survey: it contains no session (a folder floor_K/DEVICE/SESSION with poses.csv)"
            + "".join(locked[:1])
        )
    odd_folders += walks_twice(root, [(of.key, of.folder) for of in sessions])
    return SurveyFiles(root, site, tuple(sessions), findings, tuple(odd_folders))


def slugs_from_outside(root: Path) -> frozenset[str]:
    """Slugs of the sessions of a survey whose files links lead to outside it, with corrections and without."""
    files = survey_files(root, SurveySettings().landmark_sigma_m, walked=False)
    if not any(found.from_outside for found in files.sessions):
        return frozenset()
    slugs = zip(session_slugs([found.key for found in files.sessions]), files.sessions, strict=True)
    corrected = files.corrected(read_corrections(root)).sessions
    found = {slug for slug, session in slugs if session.from_outside}
    return frozenset(found | {ref.slug for ref in corrected if ref.from_outside})


def true_keys(keys: Sequence[SessionKey], corrections: Corrections, site: Site) -> list[SessionKey]:
    """Keys of sessions by those of their folders; raises SurveyError where corrections give two the same."""
    true = [corrections.true_key(key) for key in keys]
    floors = {floor.number for floor in site.floors}
    for key, own in zip(true, keys, strict=True):
        if key.floor not in floors:
            raise SurveyError(
                f"{CORRECTIONS_FILE}: [[set_floor]] assigns {own} to floor {key.floor}, which does not exist"
            )
        if key != own and true.count(key) > 1:
            raise SurveyError(f"{CORRECTIONS_FILE}: {own} would become {key}, but this session already exists")
    return true


def _sessions(root: Path) -> tuple[list[SessionRef], list[Finding]]:
    sessions = []
    folders, findings = session_folders(root)
    tied = {tie.resolve() for _, folder in folders for tie in tied_recordings(folder)}
    for key, folder in folders:
        packed = zip_of(folder)
        if folder.resolve() in tied or (packed is not None and packed.resolve() in tied):
            continue  # its readings are those of the walk that it is tied to
        path = os.fsencode(folder.relative_to(root)).decode("utf-8", errors="replace")
        name = format_of(folder) if packed is None or folder.exists() else None
        if "\ufffd" in path:
            message = "the folder's name is not UTF-8, so it is skipped: rename it"
            findings.append(site_finding(_UNRECOGNISED, path, message))
        elif name is not None:
            sessions.append(SessionRef(key, folder, name, "", from_outside=_is_from_outside(root, folder)))
            if packed is not None:
                message = (
                    f"is skipped, because the folder {folder.name} next to it is already a session; remove one of "
                    "the two"
                )
                findings.append(site_finding("zipped_session", f"{path}.zip", message))
        elif packed is None:
            found = "it contains no file of a known session format and is skipped"
            findings.append(site_finding(_UNRECOGNISED, path, found, Severity.INFO))
        elif (name := _format_in_zip(root, packed, findings)) is not None:
            outside = _is_from_outside(root, folder, packed)
            sessions.append(SessionRef(key, folder, name, "", packed=packed, from_outside=outside))
    return sessions, findings


def _is_from_outside(root: Path, folder: Path, *packed: Path) -> bool:
    """Whether links, or ties of companions, lead to anything of a session outside the survey."""
    return is_from_outside(root, (folder, *packed, *tied_recordings(folder)))


def _format_in_zip(root: Path, packed: Path, findings: list[Finding]) -> str | None:
    shown = packed.relative_to(root).as_posix()
    try:
        name = format_in_zip(root, packed)
    except (DatasetError, OSError) as error:
        message = f"the zip file cannot be read ({error}) and is skipped: send it again, or check its permissions"
        findings.append(site_finding(_UNRECOGNISED, shown, message))
        return None
    if name is None:
        findings.append(
            site_finding(_UNRECOGNISED, shown, "the zip file contains no known recording and is skipped", Severity.INFO)
        )
    return name
