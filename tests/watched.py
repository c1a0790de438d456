"""Counts what a process writes below a folder, here or in a store, and lets a test act just before a certain step."""

from __future__ import annotations

import os
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Any
from unittest.mock import patch

_WRITES = os.O_WRONLY | os.O_RDWR | os.O_CREAT
_PLACES: dict[str, tuple[int, int | None]] = {
    "os.mkdir": (0, 2),
    "os.remove": (0, 1),
    "os.rmdir": (0, 1),
    "os.rename": (1, 3),
    "os.link": (1, 3),
    "os.symlink": (1, 2),
    "os.truncate": (0, None),
}
"""By audit event: which argument is the path that changes, and which the folder that it is relative to."""


@dataclass
class Watch:
    """Counts files and folders that are opened for writing, made, renamed, linked or removed."""

    folder: str
    text: str
    act: Callable[[int], None]
    """Called before each of them with its number, from 1."""
    seen: int = 0

    def step(self, path: object, folder: object = None) -> None:
        """Count one, if its path is below the folder and contains the text."""
        if not isinstance(path, str | os.PathLike):
            return
        place = os.fspath(path)
        if isinstance(folder, int) and folder >= 0 and not Path(place).is_absolute():
            with suppress(OSError):
                place = str(Path(f"/proc/self/fd/{folder}").readlink() / place)
        if place.startswith(self.folder) and self.text in place:
            self.seen += 1
            self.act(self.seen)

    def hear(self, event: str, arguments: tuple[Any, ...]) -> None:
        """Take an audit event."""
        if event == "open":
            if (arguments[2] or 0) & _WRITES:
                self.step(arguments[0])
        elif event in _PLACES:
            path, folder = _PLACES[event]
            self.step(arguments[path], None if folder is None else arguments[folder])


_watches: list[Watch] = []
_hooked = False


def _hook(event: str, arguments: tuple[Any, ...]) -> None:
    for watch in tuple(_watches):
        watch.hear(event, arguments)


@contextmanager
def watched(folder: Path, text: str = "", act: Callable[[int], None] = lambda _: None) -> Iterator[Watch]:
    """Watch what this process writes as long as the block lasts."""
    global _hooked
    if not _hooked:  # a hook cannot be removed again
        sys.addaudithook(_hook)
        _hooked = True
    watch = Watch(str(folder), text, act)
    with _native_writes(watch):
        _watches.append(watch)
        try:
            yield watch
        finally:
            _watches.remove(watch)


@contextmanager
def _native_writes(watch: Watch) -> Iterator[None]:
    """Count what no audit event names: files opened relative to a folder's handle, and objects in a store."""
    from vislam2tag.common.files.store import Store

    opened, put, delete = os.open, Store._put, Store.delete

    def open_counted(path: Any, flags: int, mode: int = 0o777, *, dir_fd: int | None = None) -> int:
        if dir_fd is not None and flags & _WRITES:
            watch.step(path, dir_fd)
        return opened(path, flags, mode, dir_fd=dir_fd)

    def put_counted(store: Store, name: str, *arguments: Any) -> Any:
        watch.step(Path(f"{store.address}/{name}"))
        return put(store, name, *arguments)

    def delete_counted(store: Store, names: Any) -> None:
        wanted = list(names)
        for name in wanted[:1]:
            watch.step(Path(f"{store.address}/{name}"))
        delete(store, wanted)

    with (
        patch.object(os, "open", open_counted),
        patch.object(Store, "_put", put_counted),
        patch.object(Store, "delete", delete_counted),
    ):
        yield
