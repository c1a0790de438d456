"""Options that are settings, and the page about all settings: made from the tree, so that each is described once."""

from __future__ import annotations

import ast
import inspect
import textwrap
from collections.abc import Mapping
from functools import cache
from pathlib import Path
from typing import Annotated, Any, TypeAlias

import typer
from pydantic import ValidationError
from pydantic.fields import FieldInfo

from vislam2tag.cli.terminal import say
from vislam2tag.common.errors import UsageError
from vislam2tag.common.files.toml_file import toml_value
from vislam2tag.common.records import FiniteRecord
from vislam2tag.settings import (
    Settings,
    extreme_setting,
    part_of,
    read_settings,
    setting_fields,
    with_values,
    wrong_setting,
)
from vislam2tag.site.settings import SETTINGS_FILE

ConfigFile: TypeAlias = Annotated[
    Path | None, typer.Option(metavar="FILE", help="Settings as TOML (docs/reference/settings.md); options win.")
]
_NAMES = {"simulation.building.landmarks": "landmark-count", "labels.rule": "label-rule", "plan.sheets": "sheet"}
"""Options that are not named like their setting, hyphens for underscores."""


def option_of(name: str) -> str:
    """The option that gives a setting: ``--max-sigma-m`` for ``labels.max_sigma_m``."""
    return "--" + _NAMES.get(name, name.rpartition(".")[2].replace("_", "-"))


def setting(name: str) -> Any:
    """Option of a command for a setting, described as the setting is; None where it is not given."""
    record, field = _owner(name)
    text = _texts(record)[name.rpartition(".")[2]].replace("`", "")
    flag = option_of(name)
    names = f"{flag}/--no-{flag[2:]}" if field.annotation is bool else flag
    default = getattr(field.default, "value", field.default)
    return typer.Option(names, help=text if default is None else f"{text}  [default: {str(default).lower()}]")


def settings_of(config: Path | None, given: Mapping[str, object], survey: Path | None = None) -> Settings:
    """Settings of a file with those that options give, by full name, in their place; None: not given.

    Without a file, that of the ``survey`` counts, where there is one, and is told.

    Raises UsageError that names the file and the setting, or the option as it was typed.
    """
    if config is None and survey is not None and (survey / SETTINGS_FILE).is_file():
        config = survey / SETTINGS_FILE
        say(f"settings of {config}", err=True)
    settings = Settings() if config is None else read_settings(config)
    given = {name: value for name, value in given.items() if value is not None}
    try:
        settings = with_values(settings, given)
    except ValidationError as error:
        name, why = wrong_setting(error)
        raise UsageError(f"{option_of(name)} {why}") from error
    if extreme := extreme_setting(settings):
        name = option_of(extreme[0]) if extreme[0] in given else f"--config {config}: {extreme[0]}"
        raise UsageError(f"{name}: {extreme[1]:g} is beyond all sizes; give a number between 1e-6 and 1e9")
    return settings


def settings_page() -> str:
    """docs/reference/settings.md."""
    lines = [_HEAD]
    for name, field in setting_fields():
        part = part_of(field)
        if part is not None:
            title = " ".join((inspect.getdoc(part) or "").replace("``", "`").split())
            lines += ["", f"## {name}", "", title, "", "| setting | default | range | |"]
            lines += ["| --- | --- | --- | --- |"]
        else:
            record, _ = _owner(name)
            cells = (f"`{name}`", _default(field), _range(field), _texts(record)[name.rpartition(".")[2]])
            lines.append(f"| {' | '.join(cells)} |")
    return "\n".join(lines) + "\n"


_HEAD = """# Settings

For whoever changes a setting.

Made by `make docs-pages`; each setting is defined and described in the `settings.py` of the package that uses it.
A command with `--config FILE` takes a TOML file of them, such as

```toml
strategy = "smoother"

[mapping]
visit_radius_m = 1.5

[mapping.smoother]
sighting_range_m = 4.0

[labels]
max_sigma_m = 0.3
```

and of the file what concerns it. Without it, `vislam2tag.toml` in the survey's folder is taken, and told, by `process`,
`run`, `check`, `diagnose`, `evaluate`, `dataset`, `survey-landmarks` and `plan`. Options win over the file; the
resolved settings are kept with each result. An option is named like its setting and ends, as that does, with the unit
of its number.

A positioning model's parameters are no settings of this tree but arguments of its `__init__`, as in scikit-learn, and
described there with their defaults (`vislam2tag.positioning.models`). `train --model weighted-knn --set k=3` and
`benchmark --set weighted-knn.k=3` set one; the model's file and the benchmark's record keep them.

| setting | default | range | |
| --- | --- | --- | --- |"""


def _owner(full_name: str) -> tuple[type[FiniteRecord], FieldInfo]:
    """The class that a setting is a field of, and the field."""
    *parts, last = full_name.split(".")
    record: type[FiniteRecord] = Settings
    for name in parts:
        part = part_of(record.model_fields[name])
        assert part is not None, name
        record = part
    return record, record.model_fields[last]


@cache
def _texts(record: type[FiniteRecord]) -> dict[str, str]:
    """What stands below each field of a class, on one line, for people who see no markup."""
    texts: dict[str, str] = {}
    for base in record.__bases__:  # what it inherits is described there
        if issubclass(base, FiniteRecord):
            texts |= _texts(base)
    (body,) = ast.parse(textwrap.dedent(inspect.getsource(record))).body
    assert isinstance(body, ast.ClassDef)
    last = ""
    for node in body.body:
        if isinstance(node, ast.AnnAssign) and isinstance(node.target, ast.Name):
            last = node.target.id
            texts[last] = ""
        elif last and isinstance(node, ast.Expr) and isinstance(node.value, ast.Constant):
            texts[last] = " ".join(str(node.value.value).replace("``", "`").split())
            last = ""
    return texts


def _default(field: FieldInfo) -> str:
    """A default as TOML has it, as code; empty where there is none."""
    return "" if field.default is None else f"`{toml_value(field.default)}`"


def _range(field: FieldInfo) -> str:
    """Bounds of a number, such as ``> 0``."""
    signs = {"gt": ">", "ge": "≥", "lt": "<", "le": "≤"}
    bounds = [
        f"{sign} {getattr(item, key)}" for item in field.metadata for key, sign in signs.items() if hasattr(item, key)
    ]
    return ", ".join(bounds)
