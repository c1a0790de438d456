"""The base of what is kept as JSON or TOML and of settings: a value whose fields are checked and never change."""

from __future__ import annotations

from pydantic import BaseModel, ConfigDict


class Record(BaseModel):
    """A frozen record; an unknown field is refused."""

    model_config = ConfigDict(frozen=True, extra="forbid")


class FiniteRecord(Record, allow_inf_nan=False):
    """A record whose numbers are finite, but for fields that say otherwise."""
