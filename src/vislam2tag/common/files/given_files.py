"""Files and folders that others give: paths as text, and reading what is a plain file.

Pipes, sockets and devices in a file's place are refused, not waited for.
"""

from __future__ import annotations

import errno
import json
import re
import stat
import tomllib
from collections.abc import Sequence
from os import PathLike
from pathlib import Path
from typing import Any, TypeAlias

AnyPath: TypeAlias = str | PathLike[str]
"""A folder or file as people give it; functions make a Path of it first."""


def path_or_none(given: AnyPath | None) -> Path | None:
    """Return a path that may be left out."""
    return None if given is None else Path(given)


def paths_of(given: AnyPath | Sequence[AnyPath]) -> list[Path]:
    """Return one path or several as a list; text is one."""
    return [Path(given)] if isinstance(given, (str, PathLike)) else [Path(one) for one in given]


_DEEP_KEY = re.compile(r"""(?<![\w-])(?:(?:"[^"\n]*"|'[^'\n]*'|[\w-]++)[ \t]*\.[ \t]*){32}""")
"""A dotted key of more parts than any file has: tomllib takes memory by their square, gigabytes for 20,000."""


def plain(path: Path) -> Path:
    """Return the path of something that can be read to its end (or of a folder, which opening it shows).

    Raises OSError for a pipe, socket or device, and where nothing is there.
    """
    if not (stat.S_ISREG(path.stat().st_mode) or path.is_dir()):
        raise OSError(errno.EINVAL, "it is a pipe, socket or device, not a regular file", str(path))
    return path


def read_bytes(path: Path) -> bytes:
    """Read a plain file; raises OSError where it is none or cannot be read."""
    return plain(path).read_bytes()


def read_json(path: Path) -> Any:
    """Read a JSON file; raises OSError where it cannot be read, ValueError where it contains something else."""
    return json_values(read_bytes(path))


def json_values(content: bytes) -> Any:
    """Read the content of a JSON file; raises ValueError where it is something else."""
    try:
        return json.loads(content)
    except RecursionError as error:
        raise ValueError("it is nested too deep") from error


def read_toml_values(path: Path) -> dict[str, Any]:
    """Read a TOML file; raises OSError where it cannot be read, ValueError where it contains something else."""
    return toml_values(read_bytes(path))


def toml_values(content: bytes) -> dict[str, Any]:
    """Read the content of a TOML file; raises ValueError where it is something else."""
    try:
        text = content.decode("utf-8-sig")
        if _DEEP_KEY.search(text):
            raise ValueError("one of its keys is nested too deep")
        return tomllib.loads(text)
    except RecursionError as error:
        raise ValueError("it is nested too deep") from error
