"""TOML files that people write: read into records with one clear message for what is wrong, and written."""

from __future__ import annotations

import datetime as dt
import json
import re
from collections.abc import Mapping, Sequence
from difflib import get_close_matches
from pathlib import Path
from types import NoneType
from typing import Any, TypeVar, get_args

from pydantic import BaseModel, ValidationError
from pydantic.fields import FieldInfo

from vislam2tag.common.errors import SurveyError
from vislam2tag.common.files.given_files import read_toml_values

Made = TypeVar("Made", bound=BaseModel)

_WORDING = {
    "extra_forbidden": "unknown name, check the spelling",
    "missing": "missing; add it",
    "tuple_type": "each entry must start with its name in double brackets",
}
"""Our words for the mistakes that the validator describes in a programmer's."""


def read_toml(path: Path, record: type[Made]) -> Made:
    """Read a TOML file into a record.

    Raises FileNotFoundError where there is none, SurveyError, naming file and entry, where it cannot be read or says
    what it cannot.
    """
    try:
        return record.model_validate(read_toml_values(path))
    except FileNotFoundError:
        raise
    except OSError as error:
        raise SurveyError(f"{path}: cannot be read: {error.strerror}") from error
    except ValidationError as error:
        raise SurveyError(f"{path}: {first_problem(error, record)}") from error
    except ValueError as error:
        raise SurveyError(f"{path}: the file is not valid TOML: {error}; correct or remove it") from error


def first_problem(error: ValidationError, record: type[BaseModel]) -> str:
    """Say which entry of the TOML file of a record is wrong first, and why."""
    problem = error.errors()[0]
    wrong = _WORDING.get(problem["type"], problem["msg"].removeprefix("Value error, "))
    if problem["type"] == "extra_forbidden":
        near = get_close_matches(str(problem["loc"][-1]), _names_beside(record, problem["loc"]), 1, 0.0)
        wrong += f" (the closest name is {near[0]})" if near else ""
    place = _place(problem["loc"], isinstance(problem["input"], list) or problem["type"] == "tuple_type")
    return f"{place}{': ' if place else ''}{wrong}{'' if problem['type'] == 'missing' else '; correct or remove it'}"


def _names_beside(record: Any, loc: Sequence[int | str]) -> list[str]:
    """Names that could be in place of the last one of a path of names and numbers; none if its types do not show it."""
    for part in loc[:-1]:
        if isinstance(part, str):
            record = next((field.annotation for name, field in _fields(record) if name == part), None)
        record = next((kind for kind in (get_args(record) or [record]) if kind is not NoneType), None)
    return [name for name, _ in _fields(record)]


def _fields(record: Any) -> list[tuple[str, FieldInfo]]:
    """Fields of a record by the names that they have in the file."""
    return [(field.alias or name, field) for name, field in getattr(record, "model_fields", {}).items()]


def _place(loc: Sequence[int | str], is_list: bool) -> str:
    """Name an entry as the file spells it: ``[[floors]] number 2, plan, points 1``; ``is_list``: it contains
    several."""
    if not loc:
        return ""
    head, rest = loc[0], loc[1:]
    if rest and isinstance(rest[0], int):
        parts, rest = [f"[[{head}]] number {rest[0] + 1}"], rest[1:]
    elif rest:
        parts = [f"[{head}]"]
    else:
        parts = [f"[[{head}]]" if is_list else str(head)]
    for part in rest:
        if isinstance(part, int):
            parts[-1] += f" {part + 1}"
        else:
            parts.append(part)
    return ", ".join(parts)


def toml_value(value: object) -> str:
    """Write a value as TOML on one line; a mapping becomes an inline table without what is None."""
    if isinstance(value, Mapping):
        parts = (f"{_key(str(key))} = {toml_value(part)}" for key, part in value.items() if part is not None)
        return "{ " + ", ".join(parts) + " }"
    if isinstance(value, Sequence) and not isinstance(value, str):
        return "[" + ", ".join(map(toml_value, value)) + "]"
    if isinstance(value, dt.date):
        return value.isoformat()
    if isinstance(value, float):
        value += 0.0  # zero has no sign
    # Strings are JSON's, except for U+007F.
    return json.dumps(value, ensure_ascii=False).replace("\x7f", "\\u007f")


def _key(name: str) -> str:
    return name if re.fullmatch(r"[A-Za-z0-9_-]+", name) else toml_value(name)
