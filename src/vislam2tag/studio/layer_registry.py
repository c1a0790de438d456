"""Registry of further map layers; a new layer only needs one module in ``layers``."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import TypeAlias

from vislam2tag.common import plugins
from vislam2tag.common.plugins import Registry
from vislam2tag.studio.work_messages import Feature, Title
from vislam2tag.studio.workspace import Workspace

Features: TypeAlias = Callable[[Workspace, int], list[Feature]]
"""Draws shapes of the survey or its labels on a floor; raises SurveyError or UsageError, which the page shows."""


@dataclass(frozen=True)
class Layer:
    """A layer of the map; ``shown``: visible by default."""

    name: str
    title: Title
    features: Features
    shown: bool = False


LAYERS: Registry[Layer] = Registry(plugins.STUDIO_LAYERS)


def register(layer: Layer) -> None:
    """Register a layer by its name; called once at the end of its module."""
    LAYERS.add(layer.name, layer)
