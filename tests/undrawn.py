"""Figures that are composed but not drawn, which takes longest of all: for tests that are not about how they look."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from typing import IO, Any

import pytest
from matplotlib.figure import Figure
from PIL import Image


@contextmanager
def undrawn() -> Iterator[None]:
    """Let every figure that is saved be the shortest file of its format."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(Figure, "savefig", _save_nothing)
        yield


def _save_nothing(_figure: Figure, file: IO[bytes], *, format: str, **_options: Any) -> None:
    if format == "png":
        Image.new("L", (1, 1)).save(file, "png")
    else:
        file.write(b"<svg xmlns='http://www.w3.org/2000/svg'/>" if format == "svg" else b"%PDF-1.4")
