"""The protocol of plan formats and their registry; adding a format touches one module of this package."""

from __future__ import annotations

from pathlib import Path
from typing import Protocol

from vislam2tag.common import plugins
from vislam2tag.common.extras import missing_extra
from vislam2tag.common.plugins import Registry
from vislam2tag.site.plans.drawing import PlanDrawing, refuse_too_many
from vislam2tag.site.plans.source import PlanSource


class PlanFormat(Protocol):
    """Reads the plans of one format."""

    name: str
    suffixes: tuple[str, ...]
    """Of its files, lower case, with the dot; empty for folders."""

    def recognises(self, path: Path) -> bool:
        """Tell from a path with one of the suffixes whether it is of this format; may look inside."""
        ...

    def read(self, path: Path, source: PlanSource) -> PlanDrawing:
        """Read a plan; raises OSError, whose text completes a sentence about the file."""
        ...


FORMATS: Registry[PlanFormat] = Registry(plugins.PLAN_FORMATS)


def register(plan_format: PlanFormat) -> None:
    """Make a format known by its name; called once at the end of the format's own module."""
    FORMATS.add(plan_format.name, plan_format)


def read_drawing(path: Path, source: PlanSource) -> PlanDrawing:
    """Read a plan of any known format; raises OSError, whose text completes a sentence about the file."""
    if not path.exists():
        raise OSError("is not there: correct its name or add it")
    suffix = "" if path.is_dir() else path.suffix.lower()
    for known in FORMATS.all().values():
        if suffix in known.suffixes and known.recognises(path):
            try:
                drawing = known.read(path, source)
            except ModuleNotFoundError as error:
                raise OSError(missing_extra(error) or str(error)) from error
            refuse_too_many(drawing.point_count)
            return drawing
    if suffix == ".dwg":
        raise OSError("is a DWG, which only its maker's programs read; save it as DXF")
    raise OSError(f"is of no known format; plans end with {', '.join(plan_suffixes())}")


def plan_suffixes() -> tuple[str, ...]:
    """Endings of all plan files, sorted."""
    return tuple(sorted({suffix for known in FORMATS.all().values() for suffix in known.suffixes if suffix}))
