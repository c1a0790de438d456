"""Further layers of the map: what one is, and those that there are; adding one touches one module of ``layers``."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import TypeAlias

from vislam2tag.common import plugins
from vislam2tag.common.plugins import Registry
from vislam2tag.studio.work_messages import Feature, Title
from vislam2tag.studio.workspace import Workspace

Features: TypeAlias = Callable[[Workspace, int], list[Feature]]
"""Draws something of the survey or its labels on a floor; raises SurveyError or UsageError, which the page shows."""


@dataclass(frozen=True)
class Layer:
    """A layer of the map; ``shown`` without being asked for."""

    name: str
    title: Title
    features: Features
    shown: bool = False


LAYERS: Registry[Layer] = Registry(plugins.STUDIO_LAYERS)


def register(layer: Layer) -> None:
    """Make a layer known by its name; called once at the end of its own module."""
    LAYERS.add(layer.name, layer)
