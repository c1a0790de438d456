"""Whole folders in an object store, as folders of this machine for as long as a command needs them.

For what is read or made as a whole (data sets, pages); sessions are fetched one at a time, by ``sessions/``.
"""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path, PurePosixPath
from tempfile import TemporaryDirectory

from vislam2tag.common.errors import UsageError
from vislam2tag.common.files.store import Store, is_safe_name, store_at


@contextmanager
def folder_at_hand(folder: Path) -> Iterator[Path]:
    """Yield a folder for one by address, fetched whole, which lasts as long as the block; one of this machine as it is.

    Raises UsageError where nothing is stored there, StoreError where the store cannot be read.
    """
    store = store_at(folder)
    if store is None:
        yield folder
        return
    with place_for(store) as here:
        for file in store.list():
            if is_safe_name(file.name):
                (here / file.name).parent.mkdir(parents=True, exist_ok=True)
                store.fetch(file.name, here / file.name)
        if not here.exists():
            raise UsageError(f"{store.address}: nothing is stored there")
        yield here


@contextmanager
def place_for(store: Store) -> Iterator[Path]:
    """Yield where a folder of this machine can stand for one in a store, by its name; it goes with the block."""
    with TemporaryDirectory(prefix="vislam2tag-") as scratch:
        yield Path(scratch).resolve() / PurePosixPath(store.address).name
