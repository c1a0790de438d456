"""A survey in an object store, as a folder of this machine that holds its site's files and only the names of the rest.

Sessions' files are there without their content, so that what only looks at names works as in any survey; whoever reads
a session fetches its files for as long as that takes (:mod:`vislam2tag.sessions.registry`, ``at_hand``).
"""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path, PurePosixPath

from vislam2tag.common.errors import SurveyError
from vislam2tag.common.files.store import Listed, Store, is_safe_name, store_at
from vislam2tag.common.files.stored_folder import place_for
from vislam2tag.survey.discover import site_files
from vislam2tag.survey.model import StoredFolder
from vislam2tag.survey.settings import SETTINGS_FILE
from vislam2tag.survey.site_file import SITE_FILE


@dataclass(frozen=True)
class _Outline:
    store: Store
    files: dict[str, list[Listed]]
    """By path of a folder, all that is listed below it or, for a file's own path, itself."""


_OUTLINES: dict[Path, _Outline] = {}
"""By folder of this machine, the surveys in stores that are open."""


@contextmanager
def survey_at_hand(survey: Path) -> Iterator[Path]:
    """Yield a folder for a survey by address, which lasts as long as the block; one of this machine as it is.

    Raises SurveyError where nothing is stored there, StoreError where the store cannot be read.
    """
    store = store_at(survey)
    if store is None:
        yield survey
        return
    with place_for(store) as root:
        listed = _without_folders(sorted(file for file in store.list() if is_safe_name(file.name)))
        if not listed:
            raise SurveyError(f"{store.address}: nothing is stored there; give the address of a survey's folder")
        _outline(root, listed)
        _fetch_site(root, store)
        _OUTLINES[root] = _Outline(store, _by_folder(listed))
        try:
            yield root
        finally:
            del _OUTLINES[root]


def stored_folder(root: Path, folder: Path) -> StoredFolder | None:
    """Where a session of an open survey lies in its store; None for a survey of this machine."""
    outline = _OUTLINES.get(root)
    if outline is None:
        return None
    name = folder.relative_to(root).as_posix()
    return StoredFolder(outline.store, name, tuple(outline.files[name]))


def _without_folders(files: list[Listed]) -> list[Listed]:
    """Leave out objects that only stand for a folder."""
    folders = {parent.as_posix() for file in files for parent in PurePosixPath(file.name).parents}
    return [file for file in files if file.name not in folders]


def _outline(root: Path, files: list[Listed]) -> None:
    root.mkdir()
    made = {root}
    for file in files:
        path = root / file.name
        if path.parent not in made:
            path.parent.mkdir(parents=True, exist_ok=True)
            made.add(path.parent)
        path.touch()


def _fetch_site(root: Path, store: Store) -> None:
    """Fetch the site's own files; what they are is known once its description is there."""
    for name in (SITE_FILE, SETTINGS_FILE):
        if (root / name).exists():
            store.fetch(name, root / name)
    for path in site_files(root):
        store.fetch(path.relative_to(root).as_posix(), path)


def _by_folder(files: list[Listed]) -> dict[str, list[Listed]]:
    by_folder: dict[str, list[Listed]] = {}
    for file in files:
        path = PurePosixPath(file.name)
        for place in (path, *path.parents[:-1]):
            by_folder.setdefault(place.as_posix(), []).append(file)
    return by_folder
