"""Sessions in the zips that apps share: told by names alone, unpacked for as long as they are read.

What is found in such a session, or tied to it, is written into the folder of its name beside the zip.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager, suppress
from dataclasses import replace
from pathlib import Path, PurePosixPath

from vislam2tag.common.errors import DatasetError
from vislam2tag.common.files.archives import folder_of, zip_names
from vislam2tag.common.files.folder import Folder, scratch_folder
from vislam2tag.common.files.plain_files import plain
from vislam2tag.site.model import SessionRef


@contextmanager
def named_alike(names: Iterable[PurePosixPath]) -> Iterator[Path]:
    """Yield a folder with empty files of these names, as long as the block lasts."""
    with scratch_folder() as scratch:
        folder = scratch.folder("zip").make()
        for name in names:
            with suppress(OSError):  # a name that this system does not allow, or one that is there twice
                folder.create(name.as_posix())
        yield folder.path


def unpacked(
    ref: SessionRef,
    packed: Path,
    scratch: Folder,
    inner: Callable[[Path], Path],
    read: Callable[[Path], list[Path]] | None,
) -> SessionRef:
    """A session as one folder below ``scratch``: the files of its zip, and those that lie in the folder beside.

    ``inner`` finds the recording's folder in what the zip holds. Only the files that ``read`` lists of it are unpacked;
    None: all. Where the zip cannot be unpacked the session is as it was, and reading it tells.
    """
    try:
        with plain(packed).open("rb") as file, named_alike(zip_names(file)) as names:
            within = inner(names).relative_to(names)
            wanted = None if read is None else {_inside(path, names) for path in read(names / within)}
        folder = Folder.at(folder_of(packed, scratch, wanted=wanted) / within).make()
        for path in ref.folder.iterdir() if ref.folder.is_dir() else ():
            if path.is_file():
                folder.copy(path, path.name)
    except (DatasetError, OSError):
        return ref
    return replace(ref, folder=folder.path, packed=None, beside=ref.folder)


def _inside(path: Path, folder: Path) -> PurePosixPath:
    return PurePosixPath(path.relative_to(folder).as_posix())
