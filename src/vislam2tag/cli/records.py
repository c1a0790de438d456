"""Options of a command, as fields of a frozen record or as parameters of its function.

A field or parameter is made by :func:`option` or :func:`argument`, by ``options.setting``, or has a type of
``options.py``. A field whose type is a record adds the fields of that record. :func:`command` lets Typer see all of
them as parameters, and calls the command with the filled records.
"""

from __future__ import annotations

import inspect
from collections.abc import Callable, Iterator, Mapping
from dataclasses import MISSING, Field, field, fields, is_dataclass
from functools import wraps
from typing import Annotated, Any, get_args, get_origin, get_type_hints

import typer

from vislam2tag.common.documentation import with_pages

_INFO, _PARSE, _SETS = "typer", "parse", "sets"
"""Keys of what a field's metadata contains: for Typer, how a text is read, and which settings it gives."""


def option(
    default: Any,
    text: str,
    *names: str,
    metavar: str | None = None,
    least: float | None = None,
    most: float | None = None,
    hidden: bool = False,
    parse: Callable[[str, str], Any] | None = None,
    sets: tuple[str, ...] = (),
) -> Any:
    """Describe an option; ``default`` is ``...`` for one that must be given, and () for one that may be repeated.

    ``parse`` reads the text of the option, whose name is its second argument. ``sets`` names the settings that the
    option gives. A switch that is off has no ``--no-``.
    """
    info = typer.Option(*names, help=text, metavar=metavar, min=least, max=most, hidden=hidden)
    return described(default, info, parse, sets)


def argument(text: str, default: Any = ..., *, metavar: str | None = None) -> Any:
    """Describe an argument, required unless it has a default."""
    return described(default, typer.Argument(help=text, metavar=metavar))


def described(
    default: Any, info: Any, parse: Callable[[str, str], Any] | None = None, sets: tuple[str, ...] = ()
) -> Any:
    """Return a field with what Typer has to know of it."""
    metadata = {_INFO: info, _PARSE: parse, _SETS: sets}
    return field(metadata=metadata) if default is ... else field(default=default, metadata=metadata)


def command(work: Callable[..., None]) -> Callable[..., None]:
    """Let Typer see what a command takes, each field of a record as a parameter of its own."""

    @wraps(work)
    def called(**values: Any) -> None:
        _filled(work, values)

    called.__signature__ = inspect.Signature(list(_parameters(work)))  # type: ignore[attr-defined]
    called.__annotations__ = {}
    return called


def help_of(work: Callable[..., None]) -> str:
    """The docstring of a command with the addresses of the pages that it cites.

    ``{models}`` in it becomes the names of all models.
    """
    text = with_pages(inspect.getdoc(work) or "")
    if "{models}" not in text:
        return text
    from vislam2tag.common.plugins import MODELS

    return text.replace("{models}", ", ".join(MODELS.names()))


def group(text: str, *commands: tuple[str, str, Callable[..., None]]) -> typer.Typer:
    """Return a command of commands, each by its name, a summary and the function."""
    made = typer.Typer(help=text, no_args_is_help=True, rich_markup_mode=None)
    for name, summary, work in commands:
        made.command(name, help=help_of(work), short_help=summary)(work)
    return made


def settings_given(given: Any) -> dict[str, object]:
    """Settings, by full name, that the options of a record give; None: not given."""
    return {name: getattr(given, each.name) for each in fields(given) for name in each.metadata.get(_SETS, ())}


def _members(of: Any) -> Iterator[tuple[str, Any, Field[Any]]]:
    """Name, type and description of each field of a record, or of each parameter of a function."""
    hints = get_type_hints(of, include_extras=True)
    if is_dataclass(of):
        yield from ((each.name, hints[each.name], each) for each in fields(of))
        return
    for name, parameter in inspect.signature(of).parameters.items():
        default: Any = MISSING if parameter.default is inspect.Parameter.empty else parameter.default
        described_by: Any = default if isinstance(default, Field) else field(default=default)
        yield name, hints[name], described_by


def _parameters(of: Any) -> Iterator[inspect.Parameter]:
    for name, hint, each in _members(of):
        if is_dataclass(hint):
            yield from _parameters(hint)
            continue
        hint, default = _for_typer(name, hint, each)
        yield inspect.Parameter(name, inspect.Parameter.KEYWORD_ONLY, default=default, annotation=hint)


def _for_typer(name: str, hint: Any, each: Field[Any]) -> tuple[Any, Any]:
    """Type and default of a parameter as Typer takes them."""
    info: Any = each.metadata.get(_INFO)
    if get_origin(hint) is Annotated:
        hint, info = get_args(hint)
    default = inspect.Parameter.empty if each.default is MISSING else each.default
    if default is False and info.default is ... and not info.param_decls:
        info = typer.Option(f"--{name.replace('_', '-')}", help=info.help, hidden=info.hidden)
    if _is_repeated(hint):
        hint = list[str if each.metadata.get(_PARSE) else get_args(hint)[0]]  # type: ignore[misc]
        hint, default = (hint, default) if default is inspect.Parameter.empty else (hint | None, None)
    elif each.metadata.get(_PARSE):
        hint = str | None
    return (hint if info is None else Annotated[hint, info]), default


def _is_repeated(hint: Any) -> bool:
    return get_origin(hint) is tuple and get_args(hint)[1:] == (...,)


def _filled(of: Any, values: Mapping[str, Any]) -> Any:
    """A record made of its fields' values, or what a function returns that is called with its parameters'."""
    own = {}
    for name, hint, each in _members(of):
        if get_origin(hint) is Annotated:
            hint = get_args(hint)[0]
        own[name] = _filled(hint, values) if is_dataclass(hint) else _value(name, hint, each, values[name])
    return of(**own)


def _value(name: str, hint: Any, each: Field[Any], value: Any) -> Any:
    parse = each.metadata.get(_PARSE)
    if parse is None:
        return tuple(value or ()) if _is_repeated(hint) else value
    own = each.metadata[_INFO].default  # the first name, if it has one of its own
    option_name = own if isinstance(own, str) else f"--{name.replace('_', '-')}"
    if _is_repeated(hint):
        return tuple(parse(text, option_name) for text in value or ())
    return None if value is None else parse(value, option_name)
