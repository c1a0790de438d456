"""The protocol of mapping strategies and their registry."""

from __future__ import annotations

import importlib
import pkgutil
from collections.abc import Callable
from functools import cache
from pathlib import Path
from typing import Protocol

from vislam2tag.core.tracks import CameraTrack, LandmarkLog, Landmarks, Trajectory
from vislam2tag.errors import UsageError
from vislam2tag.mapping.in_parts import InParts
from vislam2tag.settings import Settings


class MappingStrategy(Protocol):
    """Maps one session from the tracker's frame to the building's; pure: no files, no state."""

    @property
    def needs(self) -> str:
        """What a walk must have had to be mapped, to end a sentence: "visits to two different landmarks"."""
        ...

    def map(self, camera: CameraTrack, log: LandmarkLog, landmarks: Landmarks) -> Trajectory:
        """Give each frame a position in the BCS or the cause why it has none."""
        ...


Factory = Callable[[Settings], MappingStrategy]
_FACTORIES: dict[str, Factory] = {}


def register(name: str, factory: Factory) -> None:
    """Make a strategy known by name; called once at the end of the strategy's own module."""
    _FACTORIES[name] = factory


@cache
def _load_all() -> None:
    for module in pkgutil.iter_modules([str(Path(__file__).parent)]):
        importlib.import_module(f"{__package__}.{module.name}")


def strategy_names() -> tuple[str, ...]:
    """Names of all registered strategies, sorted."""
    _load_all()
    return tuple(sorted(_FACTORIES))


def strategy_named(name: str, settings: Settings) -> MappingStrategy:
    """Make the strategy of this name with its part of the settings; raises UsageError for an unknown name.

    It maps sessions in several parts part by part.
    """
    _load_all()
    if name not in _FACTORIES:
        raise UsageError(f"no mapping strategy is called '{name}'; there are: {', '.join(strategy_names())}")
    return InParts(_FACTORIES[name](settings))
