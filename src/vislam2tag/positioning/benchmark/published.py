"""The paper's two models with the settings that were published for a data set."""

from __future__ import annotations

from collections.abc import Iterator

from vislam2tag.positioning.benchmark.protocol import ModelChoice
from vislam2tag.positioning.models import multi_cel, regression_net

GIA = "giaIndoorLoc"
_PUBLISHED = {"multi-cel": multi_cel.PUBLISHED, "regression-net": regression_net.PUBLISHED}


def published_choices(dataset: str | None = None) -> Iterator[ModelChoice]:
    """Choose both models for a data set by its public name, as for the paper's own where none is published for it."""
    for name, settings in _PUBLISHED.items():
        yield ModelChoice(name, settings.get(dataset or GIA, settings[GIA]))
