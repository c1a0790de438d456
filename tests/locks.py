"""Files and folders that the operating system refuses, also to the superuser, whom permissions do not stop."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest


def lock(monkeypatch: pytest.MonkeyPatch, locked: Path) -> None:
    """Let nobody open this file, or list this folder and look at anything below it."""
    for method in ("read_bytes", "open", "iterdir"):
        _refuse(monkeypatch, method, lambda path: path == locked or locked in path.parents)
    _refuse(monkeypatch, "stat", lambda path: locked in path.parents)


def _refuse(monkeypatch: pytest.MonkeyPatch, method: str, refused: Callable[[Path], bool]) -> None:
    allowed = getattr(Path, method)

    def guarded(path: Path, *arguments: Any, **options: Any) -> Any:
        if refused(path):
            raise PermissionError(13, "Permission denied", str(path))
        return allowed(path, *arguments, **options)

    monkeypatch.setattr(Path, method, guarded)
