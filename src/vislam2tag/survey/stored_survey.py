"""A survey in an object store, as a folder of this machine that holds its site's files and only the names of the rest.

Sessions' files are there without their content, so that what only looks at names works as in any survey; whoever reads
a session fetches its files for as long as that takes (:mod:`vislam2tag.sessions.registry`, ``at_hand``).
"""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import IO

from vislam2tag.common.errors import StoreConflictError, SurveyError
from vislam2tag.common.files.plain_files import plain, read_bytes
from vislam2tag.common.files.store import store_at
from vislam2tag.common.files.stored_folder import outline_at_hand, outline_of
from vislam2tag.survey.corrections.file import CORRECTIONS_FILE
from vislam2tag.survey.discover import site_files
from vislam2tag.survey.model import StoredFolder
from vislam2tag.survey.settings import SETTINGS_FILE
from vislam2tag.survey.site_file import SITE_FILE


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
            raise SurveyError(f"{store.address}: nothing is stored there; give the address of a survey's folder")
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
            raise StoreConflictError(f"{error}; look at it, then run the same command again") from error


def stored_folder(root: Path, folder: Path, packed: Path | None) -> StoredFolder | None:
    """Where a session of an open survey, or the zip that it is ``packed`` in, lies in its store; None for a survey of
    this machine.
    """
    outline = outline_of(root)
    if outline is None:
        return None
    name, *zips = (path.relative_to(root).as_posix() for path in (folder, packed) if path is not None)
    files = [*outline.files.get(name, ()), *(each for one in zips for each in outline.files[one])]
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


def _site(root: Path) -> Iterator[Path]:
    """The site's own files; what they are is known once its description is there."""
    described = [root / name for name in (SITE_FILE, SETTINGS_FILE) if (root / name).exists()]
    yield from described
    yield from (path for path in site_files(root) if path not in described)
