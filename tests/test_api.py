"""The public Python interface: whoever calls a function of it can make what it takes and name what it returns."""

from __future__ import annotations

import dataclasses
import inspect
import re
import subprocess
import sys
import typing
from collections.abc import Iterable, Iterator
from operator import attrgetter
from pathlib import Path
from types import UnionType
from typing import Any

import pytest
from pydantic import BaseModel

import vislam2tag
from vislam2tag import api
from vislam2tag.cli.app import COMMANDS

EXPORTED = {getattr(api, name) for name in api.__all__}
FUNCTIONS = [each for each in EXPORTED if not inspect.isclass(each)]


def classes_in(annotation: object) -> Iterator[type]:
    """Our classes that a type is made of: `Mapping[str, Floor | None]` holds `Floor`."""
    if isinstance(annotation, list):  # the arguments of a Callable
        for part in annotation:
            yield from classes_in(part)
    elif typing.get_origin(annotation) is not None or isinstance(annotation, UnionType):
        for part in typing.get_args(annotation):
            yield from classes_in(part)
    elif (
        isinstance(annotation, type)
        and annotation.__module__.startswith("vislam2tag.")
        and annotation.__name__[0] != "_"
    ):
        yield annotation


def hints(function: Any) -> dict[str, object]:
    return {"return": None} | typing.get_type_hints(function)


def fields_of(made: type) -> list[object]:
    """Types of what a value is made of, where its class says so."""
    if dataclasses.is_dataclass(made) or issubclass(made, BaseModel):
        return [hint for name, hint in typing.get_type_hints(made).items() if not name.startswith("_")]
    return []


def test_every_name_can_be_imported_and_no_other() -> None:
    everything: dict[str, object] = {}
    exec("from vislam2tag.api import *", everything)
    assert sorted(everything.keys() - {"__builtins__"}) == dir(api) == api.__all__
    with pytest.raises(ImportError, match="walk"):
        exec("from vislam2tag.api import walk", {})


def test_type_checkers_read_the_same_places() -> None:
    stub = Path(api.__file__).with_suffix(".pyi").read_text(encoding="utf-8")
    imports = {
        name: (module, original) for module, original, name in re.findall(r"from (\S+) import (\w+) as (\w+)", stub)
    }
    renamed = {name: imports[private] for name, private in re.findall(r"^(\w+) = (\w+)$", stub, re.M)}
    listed = {name: place for name, place in (imports | renamed).items() if not name.startswith("_")}
    assert listed == vars(api)["_PLACES"]


def within(classes: Iterable[type], known: frozenset[type] = frozenset()) -> frozenset[type]:
    """Classes with those of their fields, and of theirs; ``known`` ones aside."""
    waiting, found = set(classes) - known, set[type]()
    while waiting:
        found.add(made := waiting.pop())
        waiting |= {each for part in fields_of(made) for each in classes_in(part)} - found - known
    return frozenset(found)


def test_whatever_functions_take_and_return_has_a_name() -> None:
    lacking = {each for function in FUNCTIONS for hint in hints(function).values() for each in classes_in(hint)}
    assert sorted(each.__qualname__ for each in lacking - EXPORTED) == []


def test_what_no_function_returns_can_be_made() -> None:
    returned = within(each for function in FUNCTIONS for each in classes_in(hints(function)["return"]))
    taken = {each for function in FUNCTIONS for hint in hints(function).values() for each in classes_in(hint)}
    assert sorted(each.__qualname__ for each in within(taken, returned) - EXPORTED) == []


def test_every_command_but_the_servers_has_a_function_of_its_name() -> None:
    commands = {name for group in COMMANDS.values() for name in group} - {"docs", "fleet", "receive", "site", "studio"}
    names = {name.replace("-", "_") for name in commands} | {"site_init", "site_show", "site_write", "site_rebase"}
    names |= {"fleet_add", "fleet_list", "fleet_process", "fleet_report", "fleet_status"}
    lacking = {name for name in names if not {name, f"{name}_"} & set(api.__all__)}
    assert lacking == set()
    assert all(callable(getattr(api, name if name in api.__all__ else f"{name}_")) for name in names)


def test_processing_loads_no_scipy_before_a_session_needs_it() -> None:
    """It takes a process a second, and each worker imports what processing does."""
    code = "import sys; from vislam2tag.api import process; print(process.__name__, 'scipy' in sys.modules)"
    done = subprocess.run([sys.executable, "-c", code], check=True, capture_output=True, text=True)
    assert done.stdout.split() == ["process", "False"]


def test_the_package_loads_nothing_until_its_one_name_is_used() -> None:
    code = (
        "import sys, vislam2tag; print([name for name in sys.modules if name.startswith(('vislam2tag.', 'polars'))]); "
        "from vislam2tag.api import map_walk; print(vislam2tag.map_walk is map_walk)"
    )
    done = subprocess.run([sys.executable, "-c", code], check=True, capture_output=True, text=True)
    assert done.stdout.splitlines() == ["[]", "True"]
    with pytest.raises(AttributeError, match="module 'vislam2tag' has no attribute 'walk'"):
        attrgetter("walk")(vislam2tag)
