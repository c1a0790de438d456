"""Options that are settings: made from the tree of settings, so that each is described once."""

from __future__ import annotations

import ast
import inspect
import textwrap
from collections.abc import Mapping
from functools import cache, partial
from pathlib import Path
from typing import Annotated, Any, TypeAlias

import typer
from pydantic import ValidationError
from pydantic.fields import FieldInfo

from vislam2tag.cli.records import option, settings_given
from vislam2tag.cli.terminal import say
from vislam2tag.common.errors import UsageError
from vislam2tag.common.records import FiniteRecord
from vislam2tag.settings import (
    Settings,
    extreme_setting,
    part_of,
    read_settings,
    with_values,
    wrong_setting,
)
from vislam2tag.site.settings import SETTINGS_FILE

ConfigFile: TypeAlias = Annotated[
    Path | None, typer.Option(metavar="FILE", help="Settings as TOML (docs/reference/settings.md); options win.")
]
OPTION_NAMES = {
    "simulation.building.landmarks": "landmark-count",
    "labels.rule": "label-rule",
    "plan.sheets": "paper",
    "dataset.wifi_window_s": "window",
    "dataset.ble_window_s": "ble-window",
    "dataset.magnetic_window_s": "magnetic-window",
    "dataset.imu.length_s": "imu-window",
    "radio_maps.cell_m": "cell",
    "radio_maps.reach_m": "reach",
}
"""Options that are not named like their setting, hyphens for underscores."""


def option_of(name: str) -> str:
    """The option that gives a setting: ``--max-sigma-m`` for ``labels.max_sigma_m``."""
    return "--" + OPTION_NAMES.get(name, name.rpartition(".")[2].replace("_", "-"))


def setting(name: str, *, hidden: bool = False) -> Any:
    """Describe an option that gives a setting as the setting is described; None where it is not given."""
    record, field = owner_of(name)
    text = texts_of(record)[name.rpartition(".")[2]].replace("`", "")
    flag = option_of(name)
    names = f"{flag}/--no-{flag[2:]}" if field.annotation is bool else flag
    default = getattr(field.default, "value", field.default)
    shown = text if default is None else f"{text}  [default: {str(default).lower()}]"
    return option(None, shown, names, hidden=hidden, sets=(name,))


def settings_from(given: Any, survey: Path | None = None) -> Settings:
    """Settings of a command's ``--config`` with those that its options give; see :func:`settings_of`."""
    return settings_of(given.config, settings_given(given), survey)


def settings_of(config: Path | None, given: Mapping[str, object], survey: Path | None = None) -> Settings:
    """Settings of a file with those that options give, by full name, in their place; None: not given.

    Without a file, that of the ``survey`` counts, where there is one, and is told.

    Raises UsageError that names the file and the setting, or the option as it was typed.
    """
    if config is None and survey is not None and (survey / SETTINGS_FILE).is_file():
        config = survey / SETTINGS_FILE
        say(f"settings of {config}", err=True)
    settings = Settings() if config is None else read_settings(config, partial(say, err=True))
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


def owner_of(full_name: str) -> tuple[type[FiniteRecord], FieldInfo]:
    """The class that a setting is a field of, and the field."""
    *parts, last = full_name.split(".")
    record: type[FiniteRecord] = Settings
    for name in parts:
        part = part_of(record.model_fields[name])
        assert part is not None, name
        record = part
    return record, record.model_fields[last]


@cache
def texts_of(record: type[FiniteRecord]) -> dict[str, str]:
    """What stands below each field of a class, on one line, for people who see no markup."""
    texts: dict[str, str] = {}
    for base in record.__bases__:  # what it inherits is described there
        if issubclass(base, FiniteRecord):
            texts |= texts_of(base)
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
