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
            lines += ["", f"## {name}", "", title, "", "| setting | default | range | meaning |"]
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

Put settings into a TOML file, such as

```toml
strategy = "smoother"

[mapping]
visit_radius_m = 1.5

[mapping.smoother]
sighting_range_m = 4.0

[labels]
max_sigma_m = 0.3
```

and pass it with `--config FILE`. Without `--config`, a `vislam2tag.toml` in the survey's folder is used, and the
command prints its name. Options override the file. Each result keeps the settings that it was made with.

An option has the name of its setting. Settings of earlier versions that are constants now are accepted and ignored,
with a warning.

The parameters of a positioning model are not settings. Set them with `train --model weighted-knn --set k=3` or
`benchmark --set weighted-knn.k=3`. The docstrings of `vislam2tag.positioning.models` describe them.

`make docs-pages` writes this page from the `settings.py` of each package.

| setting | default | range | meaning |
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
