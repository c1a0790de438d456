"""The base of what is kept as JSON or TOML and of settings: a value whose fields are checked and never change."""

from __future__ import annotations

from typing import ClassVar

from pydantic import BaseModel, ConfigDict, model_validator


class Record(BaseModel):
    """A frozen record; an unknown field is refused."""

    model_config = ConfigDict(frozen=True, extra="forbid")


class FiniteRecord(Record, allow_inf_nan=False):
    """A record whose numbers are finite, except for fields that say otherwise."""


class SettingsRecord(FiniteRecord):
    """A part of the settings. What was a setting once is still accepted, in files and in records of results."""

    removed: ClassVar[frozenset[str]] = frozenset()
    """Names of fields and parts that are constants now; their values are not used."""

    @model_validator(mode="before")
    @classmethod
    def _without_removed(cls, given: object) -> object:
        if not isinstance(given, dict):
            return given
        return {name: value for name, value in given.items() if name not in cls.removed}
