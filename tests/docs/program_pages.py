"""docs/reference/commands.md and docs/reference/api.md, from the program itself."""

from __future__ import annotations

import inspect
import re
from collections import Counter
from collections.abc import Iterator
from enum import Enum
from typing import Any, is_typeddict

import vislam2tag.api as api
from tests.cli.test_app import command_of
from vislam2tag.cli.app import COMMANDS
from vislam2tag.cli.exit_codes import ExitCode

COMMANDS_HEAD = """\
# Commands

Run `vislam2tag COMMAND --help` for the same text in a terminal. `make docs-pages` writes this page from the program.

## Exit codes

All commands use the same exit codes. The help of a command says what they mean for it.

"""
API_HEAD = """\
# Python interface

Import names from `vislam2tag.api`. Each command has a function with its name, and a name loads only the libraries that
it needs. `AnyPath` means `str` or `Path`. `make docs-pages` writes this page from the docstrings.
"""
COMMON = 4
"""An option that this many commands describe alike is described once."""
EVERYWHERE = ("`-q`", "`-v`")
"""Options of every command, which no command lists."""
ROLE = re.compile(r":\w+:`~?([^`]+)`|``([^`]+)``")


def commands_page() -> str:
    """docs/reference/commands.md: the help of each command, by what commands are for; common options once."""
    commands = {words: command for title in COMMANDS.values() for name in title for words, command in _leaves((name,))}
    described = Counter(row for command in commands.values() for row in set(_rows(command)))
    common = {row for row, count in described.items() if count >= COMMON and row[0].startswith("`-")}
    parts = [
        COMMANDS_HEAD,
        _lines_of("exit code", [(f"{code.value} `{code.name}`", code.meaning) for code in ExitCode]),
        "\n## Common options\n\nEvery command takes `-h`, `-q` and `-v`; the others are listed with each command.\n\n",
        _table(sorted(common)),
    ]
    for title, summaries in COMMANDS.items():
        parts.append(f"\n## {title}\n")
        for name, summary in summaries.items():
            for words, command in commands.items():
                if words[0] == name:
                    parts.append(_section(words, command, f"{summary}\n\n" if words == (name,) else "", common))
    return "".join(parts)


def _leaves(words: tuple[str, ...]) -> Iterator[tuple[tuple[str, ...], Any]]:
    """A command, or for a group each command in it."""
    command = command_of(words)
    for name in getattr(command, "commands", ()):
        yield from _leaves((*words, name))
    if not hasattr(command, "commands"):
        yield words, command


def _section(words: tuple[str, ...], command: Any, summary: str, common: set[tuple[str, str]]) -> str:
    usage = " ".join(command.collect_usage_pieces(_context(command)))
    rows = _rows(command)
    shared = [names for names, meaning in rows if (names, meaning) in common and not names.startswith(EVERYWHERE)]
    own = [row for row in rows if row not in common]
    parts = [f"\n### {' '.join(words)}\n\n{summary}```sh\nvislam2tag {' '.join(words)} {usage}\n```\n\n"]
    parts.append(f"{_paragraphs(command.help)}\n\n{_table(own)}")
    if shared:
        parts.append(f"\nAnd of the common options {', '.join(shared)}.\n")
    return "".join(parts)


def _context(command: Any) -> Any:
    return command.make_context(command.name, [], resilient_parsing=True)


def _rows(command: Any) -> list[tuple[str, str]]:
    """Names and meaning of a command's arguments and options, as cells of a table."""
    rows = []
    for each in command.params:
        if getattr(each, "hidden", False):
            continue
        names = sorted((*each.opts, *each.secondary_opts), key=len)
        if each.param_type_name == "argument":
            names = [(each.metavar or each.name).strip("[].").upper()]
        value = f" {each.metavar}" if each.metavar and names[0].startswith("-") else ""
        shown = ", ".join(f"`{name}`" for name in names[:-1]) + (", " if names[1:] else "") + f"`{names[-1]}{value}`"
        _, meaning = each.get_help_record(_context(command))
        rows.append((shown, " ".join(meaning.replace("|", "\\|").replace("<", "&lt;").split())))
    return rows


def _table(rows: list[tuple[str, str]]) -> str:
    return _lines_of("option", rows) if rows else ""


def _lines_of(head: str, rows: list[tuple[str, str]]) -> str:
    lines = "".join(f"| {names} | {text} |\n" for names, text in rows)
    return f"| {head} | meaning |\n| --- | --- |\n{lines}"


def _paragraphs(text: str) -> str:
    """A command's help as Markdown: lines that Click keeps are code."""
    parts = []
    for paragraph in re.split(r"\n\s*\n", inspect.cleandoc(text)):
        if not paragraph.startswith("\b"):
            parts.append(" ".join(paragraph.split()).replace("<", "&lt;"))
            continue
        title, *lines = paragraph.removeprefix("\b").strip("\n").splitlines()
        language = "sh" if title.startswith("Example") else "text"
        parts.append(f"{title.strip()}\n\n```{language}\n{inspect.cleandoc(chr(10).join(['', *lines]))}\n```")
    return "\n\n".join(parts)


TASKS: dict[str, tuple[str, str]] = {
    "Prepare a building": (
        "preparation pipeline.site site",
        """\
from vislam2tag.api import regular_survey, simulate, site_show

simulate(regular_survey(seed=1, floors=(0,), devices=("Pixel",)), "survey")
for floor in site_show("survey").floors:
    print(floor.floor.number, floor.landmarks.total, "landmarks")
""",
    ),
    "Map walks and label readings": (
        "pipeline.labels pipeline.survey_run pipeline.run labeling estimation pipeline.demo",
        """\
from vislam2tag.api import Settings, process

summary = process("survey", "labels", Settings(strategy="smoother"))
print(summary.sessions, "walks,", summary.failed, "failed")
""",
    ),
    "Check and correct": (
        "quality",
        """\
from vislam2tag.api import check

for session in check("survey").sessions:
    print(session.session, session.estimated_m)
""",
    ),
    "Read surveys and walks": (
        "sessions core intake",
        """\
from vislam2tag.api import open_survey, read_session

survey = open_survey("survey")
session = read_session(survey.sessions[0])
print(session.key, len(session.camera.time_ns), "frames")
""",
    ),
    "Build data sets": (
        "datasets pipeline.datasets",
        """\
from vislam2tag.api import dataset, open_dataset

dataset(["labels"], "fingerprints")
print(open_dataset("fingerprints").fingerprints.collect().head())
""",
    ),
    "Train and use positioning models": (
        "positioning pipeline.positioning pipeline.paper",
        """\
from vislam2tag.api import TrainPlan, train

trained = train("fingerprints", TrainPlan(model="weighted-knn"), "building.v2t")
print(trained.saved.name)
""",
    ),
    "Process many surveys": (
        "pipeline.fleet",
        """\
from vislam2tag.api import fleet_add, fleet_process

fleet_add("fleet", ["survey"])
totals = fleet_process("fleet")
print(totals.sessions, "walks")
""",
    ),
    "Simulate": ("simulation", ""),
    "Settings, findings and errors": ("settings common", ""),
}
"""By title: the modules whose names are for that task, and an example; the examples run one after the other."""


def api_page() -> str:
    """docs/reference/api.md: by task an example, the functions, and the records that they take and return."""
    titles = {prefix: title for title, (prefixes, _) in TASKS.items() for prefix in prefixes.split()}
    names: dict[str, list[str]] = {title: [] for title in TASKS}
    for module, listed in vars(api)["NAMES_BY_MODULE"].items():
        prefix = max((prefix for prefix in titles if f"{module}.".startswith(f"{prefix}.")), key=len)
        names[titles[prefix]] += [each.partition("=")[0] for each in listed.split()]
    parts = [API_HEAD]
    for title, (_, example) in TASKS.items():
        parts.append(f"\n## {title}\n" + (f"\n```python\n{example}```\n" if example else ""))
        things = {name: getattr(api, name) for name in sorted(names[title], key=str.lower)}
        first = sorted(things, key=lambda name: isinstance(things[name], type))
        parts.append(f"\n{', '.join(f'[`{name}`](#{name.lower()})' for name in first)}.\n")
        parts += [
            f"\n### `{name}`\n\n```python\n{_signature(name, things[name])}\n```\n\n{_docstring(things[name])}\n"
            for name in first
        ]
    return "".join(parts)


def _signature(name: str, thing: Any) -> str:
    """What a call looks like, a parameter a line where it is long."""
    if isinstance(thing, type) and issubclass(thing, Enum):
        return f"{name}: " + " | ".join(repr(one.value) for one in thing)
    if hasattr(thing, "model_fields"):
        types = {
            key: hint for base in reversed(thing.__mro__) for key, hint in vars(base).get("__annotations__", {}).items()
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
    if len(whole) <= 78:
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
    """Its docstring as Markdown: indented examples are code, roles of reST their names, cited pages are links."""
    text = ROLE.sub(lambda found: f"`{found[1] or found[2]}`", inspect.getdoc(thing) or "")
    text = re.sub(r"docs/([\w-]+/[\w-]+)\.md", r"[\1](../\1.md)", text.replace("<", "&lt;"))
    return text.replace("](../reference/", "](").strip()
