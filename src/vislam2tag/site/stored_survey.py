"""A survey in an object store, as a folder of this machine that contains its site's files and only the names of the
rest.

Sessions' files are there without their content, so that what only looks at names works as in any survey; reading a
session fetches its files for as long as that takes (:mod:`vislam2tag.sessions.registry`, ``at_hand``).
"""

from __future__ import annotations

import hashlib
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path
from typing import IO

from vislam2tag.common.errors import StoreConflictError, SurveyError
from vislam2tag.common.files.folder import Folder
from vislam2tag.common.files.given_files import plain, read_bytes
from vislam2tag.common.files.store import Store, at_once, store_at
from vislam2tag.common.files.stored_folder import outline_at_hand, outline_of
from vislam2tag.site.corrections.file import CORRECTIONS_FILE
from vislam2tag.site.discover import site_files
from vislam2tag.site.floors import HEADER_BYTES, ilc20_traces
from vislam2tag.site.model import COMPANIONS, Site, StoredFile, StoredFolder
from vislam2tag.site.settings import SETTINGS_FILE
from vislam2tag.site.site_file import SITE_FILE


@contextmanager
def survey_at_hand(survey: Path) -> Iterator[Path]:
    """Yield a folder for a survey by address, which lasts as long as the block; one of this machine as it is.

    Raises SurveyError where nothing is stored there, StoreError where the store cannot be read.
    """
    store = store_at(survey)
    if store is None:
        yield survey
        return
    with outline_at_hand(store, _site) as root:
        if not root.exists():
            raise SurveyError(f"{store.address}: nothing is stored there; pass the address of a survey's folder")
        _begin_traces(store, root)
        yield root


@contextmanager
def survey_to_correct(survey: Path) -> Iterator[Path]:
    """Yield a folder as :func:`survey_at_hand`; what the block makes of its corrections is stored when it ends.

    Raises StoreConflictError where others changed them meanwhile: then theirs stay.
    """
    store = store_at(survey)
    if store is None:
        yield survey
        return
    before = store.get(CORRECTIONS_FILE)
    with survey_at_hand(survey) as root:
        yield root
        path = root / CORRECTIONS_FILE
        after = read_bytes(path) if path.exists() else None
        if after == (None if before is None else before.data):
            return
        try:
            if after is None:
                store.delete([CORRECTIONS_FILE])
            else:
                store.put_over(CORRECTIONS_FILE, after, None if before is None else before.version)
        except StoreConflictError as error:
            raise StoreConflictError(f"{error}; check it, then run the same command again") from error


def stored_folder(
    root: Path, folder: Path, packed: Path | None, tied: Callable[[Path], Iterable[Path]]
) -> StoredFolder | None:
    """Where a session of an open survey, or the zip that it is ``packed`` in, is in its store; None for a survey of
    this machine.

    ``tied`` says where recordings lie that belong to the session, be it elsewhere in the survey.
    """
    outline = outline_of(root)
    if outline is None:
        return None
    elsewhere = [path for path in tied(folder) if root in path.parents and folder not in path.parents]
    name, *others = (path.relative_to(root).as_posix() for path in (folder, packed, *elsewhere) if path is not None)
    files = [file for each in (name, *others) for file in outline.files.get(each, ())]
    return StoredFolder(outline.store, name, tuple(files))


@contextmanager
def opened(root: Path, path: Path) -> Iterator[IO[bytes]]:
    """Yield a file of an open survey, of which, in a store, only what is read is fetched.

    Raises OSError or StoreError where it cannot be opened.
    """
    outline = outline_of(root)
    if outline is None:
        with plain(path).open("rb") as file:
            yield file
    else:
        with outline.store.opened(path.relative_to(root).as_posix()) as file:
            yield file


def with_stored_plans(site: Site, root: Path) -> Site:
    """The site of an open survey, each floor with where its plan and its mask are in the store."""
    outline = outline_of(root)
    if outline is None:
        return site
    store = outline.store

    def stored(path: Path | None) -> StoredFile | None:
        if path is None or not path.is_file():
            return None
        return StoredFile(store, path.relative_to(root).as_posix(), hashlib.sha256(read_bytes(path)).hexdigest())

    floors = [replace(floor, stored_plan=stored(floor.plan), stored_mask=stored(floor.mask)) for floor in site.floors]
    return replace(site, floors=tuple(floors))


def _begin_traces(store: Store, root: Path) -> None:
    """Write of each trace of the Indoor Location Competition 2.0 the beginning, which says whose session it is."""
    traces = [path for _, path in ilc20_traces(root)]

    def beginning(path: Path) -> bytes:
        with store.opened(path.relative_to(root).as_posix()) as file:
            return bytes(file.read(HEADER_BYTES))

    for path, begun in zip(traces, at_once(beginning, traces), strict=True):
        Folder.at(root).write(path.relative_to(root).as_posix(), begun)


def _site(root: Path) -> Iterator[Path]:
    """The site's own files; what they are is known once its description is there. And what is tied to sessions."""
    described = [root / name for name in (SITE_FILE, SETTINGS_FILE) if (root / name).exists()]
    yield from described
    yield from (path for path in site_files(root) if path not in described)
    yield from sorted(root.glob(f"floor_*/*/*/{COMPANIONS}/*.json"))
