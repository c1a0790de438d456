"""All settings in one tree, which a TOML file may change. Each part is defined in the package that uses it."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping
from difflib import get_close_matches
from functools import reduce
from pathlib import Path

from pydantic import ValidationError
from pydantic.fields import FieldInfo

from vislam2tag.common.documentation import page_of
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
    """The settings of all commands. Each command uses its own part."""

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
    """Yield all settings by full name, such as ``labels.max_sigma_m``; parts come last, each before its fields."""
    parts = {name: part for name, field in record.model_fields.items() if (part := part_of(field)) is not None}
    yield from ((prefix + name, field) for name, field in record.model_fields.items() if name not in parts)
    for name, part in parts.items():
        yield prefix + name, record.model_fields[name]
        yield from setting_fields(part, f"{prefix}{name}.")


def part_of(field: FieldInfo) -> type[FiniteRecord] | None:
    """Return the class of a part of the tree, or None for a setting."""
    kind = field.annotation
    return kind if isinstance(kind, type) and issubclass(kind, FiniteRecord) else None


def removed_settings(
    given: Mapping[str, object], record: type[FiniteRecord] = Settings, prefix: str = ""
) -> Iterator[str]:
    """Yield the full names of settings in ``given`` that earlier versions had, and this one does not."""
    for name, value in given.items():
        if issubclass(record, SettingsRecord) and name in record.removed:
            yield prefix + name
        elif name in record.model_fields and isinstance(value, Mapping):
            part = part_of(record.model_fields[name])
            if part is not None:
                yield from removed_settings(value, part, f"{prefix}{name}.")


def read_settings(path: AnyPath, warn: Callable[[str], object] | None = None) -> Settings:
    """Read a TOML file of settings. Settings that are not in the file keep their defaults.

    Settings that were removed are ignored; ``warn`` gets one sentence that names them.

    Raises UsageError with the file and the setting if the file cannot be read or a value is wrong.
    """
    path = Path(path)
    try:
        given = read_toml_values(path)
    except OSError as error:
        raise UsageError(f"--config {path}: the file cannot be read: {error.strerror}") from error
    except ValueError as error:
        raise UsageError(f"--config {path}: not a valid TOML file: {error}; correct it") from error
    if warn is not None and (names := list(removed_settings(given))):
        warn(f"{path}: {', '.join(names)}: these settings were removed; their values are ignored")
    try:
        return Settings.model_validate(given)
    except ValidationError as error:
        name, why = wrong_setting(error)
        raise UsageError(f"--config {path}: {name}: {why}") from error


def with_values(settings: Settings, values: Mapping[str, object]) -> Settings:
    """Return a copy with other values, by full name; raises ValidationError if a value is invalid."""
    tree = settings.model_dump()
    for name, value in values.items():
        *parts, last = name.split(".")
        branch = tree
        for part in parts:
            branch = branch[part]
        branch[last] = value
    return Settings.model_validate(tree)


def extreme_setting(settings: Settings) -> tuple[str, float] | None:
    """Return the first setting that is too large or too small to make sense, with its value, or None.

    Infinite values are accepted if the setting allows them.
    """
    for name, field in setting_fields():
        if part_of(field) is None:
            value = reduce(getattr, name.split("."), settings)
            if isinstance(value, float) and value and math.isfinite(value) and not _LEAST <= abs(value) <= _GREATEST:
                return name, value
    return None


def wrong_setting(error: ValidationError) -> tuple[str, str]:
    """Return the full name of the first wrong setting, and the reason."""
    problem = error.errors()[0]
    name = ".".join(map(str, problem["loc"]))
    if problem["type"] == "extra_forbidden":
        nearest = get_close_matches(name, [known for known, _ in setting_fields()], 1, 0.0)[0]
        return name, f"no such setting; the closest name is {nearest} ({page_of('reference/settings')} lists all)"
    if problem["type"] == "value_error":  # about several fields together
        return name, problem["msg"].removeprefix("Value error, ")
    return name, f"{problem['input']}: {problem['msg']}"
