"""Further layers of the map: what one is, and those that there are; adding one touches one module of ``layers``."""

from __future__ import annotations

from typing import Protocol

from vislam2tag.common import plugins
from vislam2tag.common.plugins import Registry
from vislam2tag.studio.work_messages import Feature, Title
from vislam2tag.studio.workspace import Workspace


class Layer(Protocol):
    """Draws something of the survey or its labels on each floor."""

    name: str
    title: Title
    shown: bool
    """Without being asked for."""

    def features(self, workspace: Workspace, floor: int) -> list[Feature]:
        """What it draws on a floor; raises SurveyError or UsageError, which the page tells, where it cannot."""
        ...


LAYERS: Registry[Layer] = Registry(plugins.STUDIO_LAYERS)


def register(layer: Layer) -> None:
    """Make a layer known by its name; called once at the end of its own module."""
    LAYERS.add(layer.name, layer)
