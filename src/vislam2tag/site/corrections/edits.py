"""Changes of ``corrections.toml``: entries added, replaced and removed, all other lines and comments left as they are.

A library that keeps comments is not used: tomlkit (0.15) reorders entries of different tables that are mixed.
"""

from __future__ import annotations

import datetime as dt
import difflib
import hashlib
import re
import tomllib
from collections import defaultdict
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any, Literal, TypeAlias

from pydantic import Field, ValidationError

from vislam2tag.common.errors import SurveyError
from vislam2tag.common.files.atomic import only_one
from vislam2tag.common.files.folder import Folder
from vislam2tag.common.files.given_files import read_bytes, toml_values
from vislam2tag.common.files.toml_file import first_problem, toml_value
from vislam2tag.common.files.whole_output import output_errors
from vislam2tag.common.records import Record
from vislam2tag.site.corrections.file import CORRECTIONS_FILE, Corrections

_HEADER = re.compile(r"""^\s*\[\[\s*["']?([A-Za-z_]+)["']?\s*\]\]""")
_IDLE = re.compile(r"^\s*(#.*)?$", re.DOTALL)
"""Blank lines and comments: those behind an entry's last value are not part of it."""


class AddEntry(Record):
    """A further entry at the end of the file."""

    action: Literal["add"] = "add"
    table: str
    values: dict[str, Any]


class ReplaceEntry(Record):
    """Other values of an entry; comments in its lines stay."""

    action: Literal["replace"] = "replace"
    table: str
    number: Annotated[int, Field(ge=1)]
    values: dict[str, Any]


class RemoveEntry(Record):
    """An entry less."""

    action: Literal["remove"] = "remove"
    table: str
    number: Annotated[int, Field(ge=1)]


Change: TypeAlias = Annotated[AddEntry | ReplaceEntry | RemoveEntry, Field(discriminator="action")]
"""Numbers count from 1 in their table, in the text before any of several changes."""


@dataclass(frozen=True)
class EntryLines:
    """One entry of the file: the ``number``-th of its table, and its 1-based lines, the last one included."""

    table: str
    number: int
    values: Mapping[str, Any]
    first_line: int
    last_line: int


def corrections_of(text: str) -> Corrections:
    """What a text says; raises SurveyError, naming the entry, where it cannot be used."""
    return _parsed(CORRECTIONS_FILE, text.encode(), "not a TOML file: {}; correct it")


def entries_of(text: str) -> tuple[EntryLines, ...]:
    """All entries in the order of the file; raises SurveyError where it cannot be used, or not identified by lines."""
    corrections_of(text)
    lines = text_lines(text)
    told: dict[str, list[Mapping[str, Any]]] = defaultdict(list)
    found = []
    for table, start, end in entry_spans(lines):
        told[table].append(_values(lines[start:end], table))
        found.append(EntryLines(table, len(told[table]), told[table][-1], start + 1, end))
    if told != toml_values(text.encode()):
        raise SurveyError(
            f"{CORRECTIONS_FILE}: its entries cannot be changed one by one: write each below its name in double "
            "brackets, each value on lines of its own"
        )
    return tuple(found)


def entry_spans(lines: Sequence[str]) -> list[tuple[str, int, int]]:
    """Table, first line and end of each entry; comments and blank lines behind its last value are not part of it."""
    headers = [(at, match[1]) for at, line in enumerate(lines) if (match := _HEADER.match(line))]
    ends = [*(at for at, _ in headers[1:]), len(lines)]
    found = []
    for (start, table), end in zip(headers, ends, strict=False):  # no header, no end
        while _IDLE.match(lines[end - 1]):
            end -= 1
        found.append((table, start, end))
    return found


def changed_text(text: str, changes: Sequence[Change]) -> str:
    """The text with some entries added, replaced and removed; raises SurveyError where it could not be used then."""
    lines = text_lines(text)
    entries = {(entry.table, entry.number): entry for entry in entries_of(text)}
    added: list[str] = []
    for change in sorted(changes, key=lambda change: _line_of(change, entries), reverse=True):
        if isinstance(change, AddEntry):
            added.append(_written(change))
            continue
        entry = entries[change.table, change.number]
        rows = slice(entry.first_line - 1, entry.last_line)
        lines[rows] = _replaced(lines[rows], entry.values, change) if isinstance(change, ReplaceEntry) else []
    changed = "".join(lines)
    for block in added:
        gap = "" if not changed or changed.endswith("\n\n") else "\n" if changed.endswith("\n") else "\n\n"
        changed += gap + block
    corrections_of(changed)
    return changed


def difference(before: str, after: str) -> str:
    """The lines that differ as a unified diff without names; empty where none does."""
    lines = difflib.unified_diff(before.splitlines(), after.splitlines(), lineterm="", n=1)
    return "\n".join(list(lines)[2:])


def _line_of(change: Change, entries: Mapping[tuple[str, int], EntryLines]) -> int:
    if isinstance(change, AddEntry):
        return 0
    if (change.table, change.number) not in entries:
        raise SurveyError(f"{CORRECTIONS_FILE}: there is no [[{change.table}]] number {change.number}; reload the file")
    return entries[change.table, change.number].first_line


def _written(change: AddEntry) -> str:
    values = (f"{name} = {toml_value(value)}\n" for name, value in change.values.items() if value is not None)
    return f"[[{change.table}]]\n{''.join(values)}"


def _replaced(lines: list[str], before: Mapping[str, Any], change: ReplaceEntry) -> list[str]:
    """The lines of an entry with other values; those of values that stay are not touched."""
    wanted = {name: value for name, value in change.values.items() if value is not None}
    for name in before:
        if name not in wanted:
            lines = _with_line(lines, name, "", change.table)
        # A value as JSON has it.
        elif (before[name].isoformat() if isinstance(before[name], dt.date) else before[name]) != wanted[name]:
            lines = _with_line(lines, name, toml_value(wanted[name]), change.table)
    if not lines[-1].endswith("\n"):
        lines[-1] += "\n"
    return lines + [f"{name} = {toml_value(value)}\n" for name, value in wanted.items() if name not in before]


def _with_line(lines: list[str], name: str, value: str, table: str) -> list[str]:
    """The lines with another value of a name, or, for an empty value, without it."""
    begins = re.compile(rf"""^\s*["']?{re.escape(name)}["']?\s*=\s*""")
    at, match = next((at, match) for at, line in enumerate(lines) if (match := begins.match(line)))
    end = next(end for end in range(at + 1, len(lines) + 1) if _is_toml("".join(lines[at:end])))
    comment = _comment("".join(lines[at:end]))
    kept = [f"{match[0]}{value}{comment}\n"] if value else []
    changed = [*lines[:at], *kept, *lines[end:]]
    _values(changed, table)
    return changed


def _comment(line: str) -> str:
    """The comment at the end of a line with a value, with the blanks before it; empty where there is none."""
    for place in (match.start() for match in re.finditer(r"[ \t]*#", line)):
        if _is_toml(line[:place]):
            return line[place:].rstrip("\r\n")
    return ""


def _is_toml(text: str) -> bool:
    try:
        tomllib.loads(text)
    except ValueError:
        return False
    return True


def _values(lines: Sequence[str], table: str) -> Mapping[str, Any]:
    """Values of the lines of one entry; none where they are not those of one entry alone."""
    try:
        found = tomllib.loads("".join(lines))
    except ValueError:
        return {}
    entries = found.get(table)
    return entries[0] if isinstance(entries, list) and isinstance(entries[0], dict) else {}


def text_lines(text: str) -> list[str]:
    """Lines with their ends; only line feeds end one, as in TOML."""
    return re.findall(r"[^\n]*\n|[^\n]+", text)


_LOCK = f".{CORRECTIONS_FILE}.lock"
_BEGIN = "# vislam2tag diagnose --apply added from here ..."
_END = "# ... to here; vislam2tag diagnose --revert removes it"
_BLOCK = re.compile(re.escape(f"\n{_BEGIN}\n").encode() + b".*?" + re.escape(f"\n{_END}\n").encode(), re.DOTALL)


def with_entries(root: Path, lines: str) -> Corrections:
    """The survey's corrections as they would be with further entries.

    Raises SurveyError where the file as it is, or with them, cannot be used.
    """
    no_toml = "entries cannot be added to it: {}; write each entry below its name in double brackets"
    return _parsed(root / CORRECTIONS_FILE, _content(root) + _block(lines), no_toml)


def add_entries(root: Path, lines: str) -> None:
    """Add entries at the end of a survey's ``corrections.toml``; raises SurveyError where it could not be read then."""
    with _only_writer(root):
        with_entries(root, lines)
        _write(root, _content(root) + _block(lines))


def remove_added(root: Path) -> int:
    """Take out all that :func:`add_entries` added, and the file if nothing else is in it; returns how many blocks."""
    with _only_writer(root):
        content, blocks = _BLOCK.subn(b"", _content(root))
        if blocks:
            _write(root, content)
    return blocks


class ChangedMeanwhileError(SurveyError):
    """The file is no longer what a change of it was made from."""


def corrections_text(root: Path) -> tuple[str, str]:
    """Text of a survey's ``corrections.toml`` and its version, both empty where there is none.

    Raises SurveyError where it cannot be read or is not a text.
    """
    content = _content(root)
    try:
        return content.decode(), _version(content)
    except UnicodeDecodeError as error:
        raise SurveyError(f"{root / CORRECTIONS_FILE}: not a text in UTF-8: {error}; correct it") from error


def save_text(root: Path, text: str, version: str) -> str:
    """Make ``text`` the survey's ``corrections.toml`` (no file where it is empty), and return its version.

    ``version`` is that of the text which it was made from. Raises ChangedMeanwhileError where the file is another now,
    SurveyError where the text cannot be used, OutputError where it cannot be written.
    """
    corrections_of(text)
    with _only_writer(root):
        if _version(_content(root)) != version:
            raise ChangedMeanwhileError(
                f"{CORRECTIONS_FILE} was changed by someone else; reload it, then make your change again"
            )
        _write(root, text.encode())
    return _version(text.encode())


def change_text(root: Path, change: Callable[[str], str]) -> str:
    """Replace the survey's ``corrections.toml`` by what ``change`` makes of its text, and return the text before.

    No other program writes the file meanwhile. Raises what ``change`` raises, which must refuse a text that cannot be
    used, and OutputError if the file cannot be written.
    """
    with _only_writer(root):
        before, _ = corrections_text(root)
        _write(root, change(before).encode())
    return before


@contextmanager
def _only_writer(root: Path) -> Iterator[None]:
    """Let no other program change the file; raises OutputError while one does."""
    with only_one(Folder.at(root), _LOCK, f"{root / CORRECTIONS_FILE}: another program is writing it; try again"):
        yield


def _version(content: bytes) -> str:
    return hashlib.sha256(content).hexdigest() if content else ""


def _block(lines: str) -> bytes:
    return f"\n{_BEGIN}\n{lines}\n{_END}\n".encode()


def _content(root: Path) -> bytes:
    path = root / CORRECTIONS_FILE
    try:
        return read_bytes(path) if path.exists() else b""
    except OSError as error:
        raise SurveyError(f"{path}: cannot be read: {error.strerror}") from error


def _parsed(name: object, content: bytes, no_toml: str) -> Corrections:
    """The corrections in a file's content; ``no_toml`` says, with ``{}`` for the reason, that it is not TOML."""
    try:
        return Corrections.model_validate(toml_values(content))
    except ValidationError as error:
        raise SurveyError(f"{name}: {first_problem(error, Corrections)}") from error
    except ValueError as error:
        raise SurveyError(f"{name}: {no_toml.format(error)}") from error


def _write(root: Path, content: bytes) -> None:
    """Write the file; an empty one is removed."""
    with output_errors(root / CORRECTIONS_FILE):
        if content:
            Folder.at(root).write(CORRECTIONS_FILE, content)
        else:
            Folder.at(root).remove(CORRECTIONS_FILE)
