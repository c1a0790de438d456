"""Paths given as text: what a function of the public interface takes besides Path."""

from __future__ import annotations

import re
from collections.abc import Mapping
from functools import wraps
from pathlib import Path
from types import FunctionType
from typing import Any

_PATH = re.compile(r"\bPath\b")


def with_paths(value: Any) -> Any:
    """Let a function take text where its annotations say Path, also within sequences and mappings.

    Anything but a function, and a function without such a parameter, comes back as it is.
    """
    if not isinstance(value, FunctionType):
        return value
    taken = [name for name, annotation in value.__annotations__.items() if _PATH.search(str(annotation))]
    if not set(taken) - {"return"}:
        return value
    positional = value.__code__.co_varnames[: value.__code__.co_argcount]

    @wraps(value)
    def function(*arguments: Any, **options: Any) -> Any:
        places = [_path(one) if name in taken else one for name, one in zip(positional, arguments, strict=False)]
        named = {name: _path(one) if name in taken else one for name, one in options.items()}
        return value(*places, *arguments[len(places) :], **named)

    return function


def _path(given: Any) -> Any:
    if isinstance(given, str):
        return Path(given)
    if type(given) in (list, tuple):
        return type(given)(_path(one) for one in given)
    if isinstance(given, Mapping):
        return {name: _path(one) for name, one in given.items()}
    return given
