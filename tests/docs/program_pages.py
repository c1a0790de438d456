"""docs/reference/commands.md and docs/reference/api.md, from the program itself."""

from __future__ import annotations

import inspect
import re
from enum import Enum
from typing import Any, is_typeddict

from typer.testing import CliRunner

import vislam2tag.api as api
from tests.cli.test_app import OF_SITE
from vislam2tag.cli.app import COMMANDS, app

COMMANDS_HEAD = """\
# Commands

For whoever looks up a command or an option.

Made by `make docs-pages` of the program's own help. Every command has `--help`; exit codes are 0 (all right), 1 (some
of it failed), 2 (wrong usage) and 130 (interrupted).
"""
API_HEAD = """\
# Python interface

For whoever calls the program from Python.

Made by `make docs-pages` of the docstrings of `vislam2tag.api`. `from vislam2tag.api import NAME` imports what a name
needs, and no more. Folders and files may be text wherever `AnyPath` stands: `str` or `Path`.
"""
ROLE = re.compile(r":\w+:`~?([^`]+)`|``([^`]+)``")


def commands_page() -> str:
    """docs/reference/commands.md: what ``--help`` says of each command, by what commands are for."""
    parts = [COMMANDS_HEAD]
    for title, names in COMMANDS.items():
        parts.append(f"\n## {title}\n")
        for name, summary in names.items():
            subcommands = OF_SITE if name == "site" else ()
            for words in ((name,), *((name, sub) for sub in subcommands)):
                shown = f"{summary}\n\n" if len(words) == 1 else ""
                parts.append(f"\n### {' '.join(words)}\n\n{shown}```text\n{_help(words)}\n```\n")
    return "".join(parts)


def _help(words: tuple[str, ...]) -> str:
    """What the program prints for ``--help``."""
    done = CliRunner().invoke(app, [*words, "--help"], prog_name="vislam2tag", env={"COLUMNS": "80"})
    assert done.exit_code == 0, done.output
    return "\n".join(line.rstrip() for line in done.output.strip().splitlines())


def api_page() -> str:
    """docs/reference/api.md: functions first, then the records and classes that they take and return."""
    things = {name: getattr(api, name) for name in sorted(api.__all__, key=str.lower)}
    functions = [name for name, thing in things.items() if callable(thing) and not isinstance(thing, type)]
    errors = [name for name, thing in things.items() if isinstance(thing, type) and issubclass(thing, Exception)]
    classes = [name for name, thing in things.items() if isinstance(thing, type) and name not in errors]
    parts = [API_HEAD]
    for title, names in (("Functions", functions), ("Classes", classes), ("Errors", errors)):
        parts.append(f"\n## {title}\n")
        parts += [
            f"\n### `{name}`\n\n```python\n{_signature(name, things[name])}\n```\n\n{_docstring(things[name])}\n"
            for name in names
        ]
    return "".join(parts)


def _signature(name: str, thing: Any) -> str:
    """What a call looks like, a parameter a line where it is long."""
    if isinstance(thing, type) and issubclass(thing, Enum):
        return f"{name}: " + " | ".join(repr(one.value) for one in thing)
    if hasattr(thing, "model_fields"):
        types = {
            key: told for base in reversed(thing.__mro__) for key, told in vars(base).get("__annotations__", {}).items()
        }
        fields = "".join(f"    {field}: {types[field]},\n" for field in thing.model_fields)
        return f"{name}(\n{fields})"
    if is_typeddict(thing):
        keys = "".join(f"    {key}: {hint.__forward_arg__},\n" for key, hint in thing.__annotations__.items())
        return f"{name}(\n{keys})"
    try:
        signature = inspect.signature(thing)
    except ValueError:
        return name
    whole = f"{name}{signature}"
    if len(whole) <= 100:
        return _readable(whole)
    lines = "".join(f"    {parameter},\n" for parameter in signature.parameters.values())
    returned = "" if signature.return_annotation is signature.empty else f" -> {signature.return_annotation}"
    return _readable(f"{name}(\n{lines}){returned}")


def _readable(text: str) -> str:
    """A signature without the names of modules and the addresses of defaults."""
    text = re.sub(r"<class '([\w.]+)'>", r"\1", text)
    text = re.sub(r"\b(?:\w+\.)+(?=[A-Z]\w*)", "", text)
    return re.sub(r"= <.*?(?: at 0x[0-9a-f]+|factory)>", "= ...", text).replace("'", "")


def _docstring(thing: Any) -> str:
    """Its docstring as Markdown: indented examples are code, roles of reST their names."""
    text = ROLE.sub(lambda found: f"`{found[1] or found[2]}`", inspect.getdoc(thing) or "")
    return text.replace("<", "&lt;").strip()
