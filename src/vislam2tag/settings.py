"""All settings in one tree; each part is defined beside what it is for. A TOML file may give any of them."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping
from difflib import get_close_matches
from functools import reduce
from pathlib import Path

from pydantic import ValidationError
from pydantic.fields import FieldInfo

from vislam2tag.common.errors import UsageError
from vislam2tag.common.files.given_files import AnyPath, read_toml_values
from vislam2tag.common.records import FiniteRecord, SettingsRecord
from vislam2tag.datasets.settings import CoverageSettings, DatasetSettings, RadioMapSettings, SplitSettings
from vislam2tag.labeling.settings import ProcessSettings
from vislam2tag.preparation.planning.settings import PlanSettings
from vislam2tag.preparation.registration.record import RegistrationSettings
from vislam2tag.preparation.sheets.settings import SheetSettings
from vislam2tag.simulation.settings import SimulationSettings
from vislam2tag.site.settings import WalkableSettings

_LEAST, _GREATEST = 1e-6, 1e9


class Settings(ProcessSettings):
    """The settings of all commands; each takes its part."""

    dataset: DatasetSettings = DatasetSettings()
    split: SplitSettings = SplitSettings()
    coverage: CoverageSettings = CoverageSettings()
    radio_maps: RadioMapSettings = RadioMapSettings()
    plan: PlanSettings = PlanSettings()
    registration: RegistrationSettings = RegistrationSettings()
    walkable: WalkableSettings = WalkableSettings()
    sheets: SheetSettings = SheetSettings()
    simulation: SimulationSettings = SimulationSettings()


def setting_fields(record: type[FiniteRecord] = Settings, prefix: str = "") -> Iterator[tuple[str, FieldInfo]]:
    """All settings by their full names, such as ``labels.max_sigma_m``; parts come last, each before its fields."""
    parts = {name: part for name, field in record.model_fields.items() if (part := part_of(field)) is not None}
    yield from ((prefix + name, field) for name, field in record.model_fields.items() if name not in parts)
    for name, part in parts.items():
        yield prefix + name, record.model_fields[name]
        yield from setting_fields(part, f"{prefix}{name}.")


def part_of(field: FieldInfo) -> type[FiniteRecord] | None:
    """The class of a part of the tree; None for a setting."""
    kind = field.annotation
    return kind if isinstance(kind, type) and issubclass(kind, FiniteRecord) else None


def removed_settings(
    given: Mapping[str, object], record: type[FiniteRecord] = Settings, prefix: str = ""
) -> Iterator[str]:
    """Full names of what a file gives that was a setting once, or a part of the tree."""
    for name, value in given.items():
        if issubclass(record, SettingsRecord) and name in record.removed:
            yield prefix + name
        elif name in record.model_fields and isinstance(value, Mapping):
            part = part_of(record.model_fields[name])
            if part is not None:
                yield from removed_settings(value, part, f"{prefix}{name}.")


def read_settings(path: AnyPath, tell: Callable[[str], object] | None = None) -> Settings:
    """Read a TOML file with some settings; the others keep their defaults.

    What the file has of settings that are constants now is not used; that goes to ``tell``, in one sentence.

    Raises UsageError, naming file and setting, for what cannot be read or used; of an unknown one the nearest known.
    """
    path = Path(path)
    try:
        given = read_toml_values(path)
    except OSError as error:
        raise UsageError(f"--config {path}: cannot be read: {error.strerror}") from error
    except ValueError as error:
        raise UsageError(f"--config {path}: not a TOML file: {error}; correct it") from error
    if tell is not None and (names := list(removed_settings(given))):
        tell(f"{path}: {', '.join(names)}: no longer a setting but a constant; the value is not used")
    try:
        return Settings.model_validate(given)
    except ValidationError as error:
        name, why = wrong_setting(error)
        raise UsageError(f"--config {path}: {name}: {why}") from error


def with_values(settings: Settings, values: Mapping[str, object]) -> Settings:
    """Replace settings by full name; raises ValidationError for a value that cannot be used."""
    tree = settings.model_dump()
    for name, value in values.items():
        *parts, last = name.split(".")
        branch = tree
        for part in parts:
            branch = branch[part]
        branch[last] = value
    return Settings.model_validate(tree)


def extreme_setting(settings: Settings) -> tuple[str, float] | None:
    """The first setting, with its value, that is greater or smaller than any that could be meant; None without any.

    Of a grid of such cells or a window of such length nothing can be counted. Infinite is what a setting allows.
    """
    for name, field in setting_fields():
        if part_of(field) is None:
            value = reduce(getattr, name.split("."), settings)
            if isinstance(value, float) and value and math.isfinite(value) and not _LEAST <= abs(value) <= _GREATEST:
                return name, value
    return None


def wrong_setting(error: ValidationError) -> tuple[str, str]:
    """Full name of the first setting that is wrong, and why."""
    problem = error.errors()[0]
    name = ".".join(map(str, problem["loc"]))
    if problem["type"] == "extra_forbidden":
        nearest = get_close_matches(name, [known for known, _ in setting_fields()], 1, 0.0)[0]
        return name, f"no such setting; the nearest is {nearest} (docs/reference/settings.md has all)"
    if problem["type"] == "value_error":  # about several fields together
        return name, problem["msg"].removeprefix("Value error, ")
    return name, f"{problem['input']}: {problem['msg']}"
