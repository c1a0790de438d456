"""How values show themselves in a notebook or at a prompt: in a line, as a small table, as a drawing."""

from __future__ import annotations

from collections.abc import Mapping
from html import escape
from importlib import import_module
from typing import Any

DRAWING = "vislam2tag.views.notebook"
"""Draws each of these values; found by its name when it is asked for, as Matplotlib takes long to load."""


class Summarised:
    """A value of many numbers that shows a few facts about itself instead of all of them."""

    def _facts(self) -> Mapping[str, object]:
        """What to show, by name."""
        raise NotImplementedError

    def __repr__(self) -> str:
        """One line of facts."""
        return f"{type(self).__name__}({', '.join(f'{name}: {fact}' for name, fact in self._facts().items())})"

    def _repr_html_(self) -> str:
        """Facts as a table, for notebooks."""
        rows = "".join(
            f"<tr><th>{escape(name)}</th><td>{escape(str(fact))}</td></tr>" for name, fact in self._facts().items()
        )
        return f"<table><caption>{escape(type(self).__name__)}</caption>{rows}</table>"


class Drawable(Summarised):
    """A value that can be drawn, too."""

    def plot(self, floor: int | None = None, axes: Any = None) -> Any:
        """Draw it with Matplotlib and return the axes: new ones, or those given.

        ``floor`` is the number of the floor to draw; None: the first that there is.
        """
        return import_module(DRAWING).plot(self, floor, axes)
