"""docs/reference/settings.md, from the tree of settings."""

from __future__ import annotations

import inspect

from pydantic.fields import FieldInfo

from tests.cli.test_app import command_of
from vislam2tag.cli.app import COMMANDS
from vislam2tag.cli.options import OPTION_NAMES, option_of, owner_of, texts_of
from vislam2tag.common.files.toml_file import toml_value
from vislam2tag.settings import part_of, setting_fields


def settings_page() -> str:
    """docs/reference/settings.md."""
    lines, hidden = [_HEAD], _hidden_options()
    for name, field in setting_fields():
        part = part_of(field)
        if part is not None:
            title = " ".join((inspect.getdoc(part) or "").replace("``", "`").split())
            lines += ["", f"## {name}", "", title, "", "| setting | default | range | |"]
            lines += ["| --- | --- | --- | --- |"]
        else:
            record, _ = owner_of(name)
            text = texts_of(record)[name.rpartition(".")[2]]
            commands = hidden.get(option_of(name), {})
            takers = [f"`{one}`" for one, help_ in commands.items() if name in OPTION_NAMES or _same(help_, text)]
            also = f" Also `{option_of(name)}` of {' and '.join(takers)}." if takers else ""
            lines.append(f"| `{name}` | {_default(field)} | {_range(field)} | {text}{also} |")
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
of its number. What was a setting once and is a constant now, beside the code that it is for, is still accepted in
files, but not used; one sentence says so.

A positioning model's parameters are no settings of this tree but arguments of its `__init__`, as in scikit-learn, and
described there with their defaults (`vislam2tag.positioning.models`). `train --model weighted-knn --set k=3` and
`benchmark --set weighted-knn.k=3` set one; the model's file and the benchmark's record keep them.

| setting | default | range | |
| --- | --- | --- | --- |"""


def _hidden_options() -> dict[str, dict[str, str]]:
    """By option, the commands that take it though their help does not show it, and what it would say."""
    found: dict[str, dict[str, str]] = {}
    for name in ("site walkable", *(name for group in COMMANDS.values() for name in group)):
        for each in command_of(tuple(name.split())).params:
            if getattr(each, "hidden", False):
                found.setdefault(each.opts[-1], {})[name] = each.help or ""
    return found


def _same(help_: str, text: str) -> bool:
    return help_.partition("  [default")[0] == text.replace("`", "")


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
