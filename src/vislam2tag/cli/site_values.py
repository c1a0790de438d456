"""What the options of ``vislam2tag site`` say, as records."""

from __future__ import annotations

import re
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

from vislam2tag.common.errors import UsageError

if TYPE_CHECKING:
    from pydantic import ValidationError

    from vislam2tag.survey.plans.source import PlanSource
    from vislam2tag.survey.site_file import FloorPart, GeoreferencePart


_NUMBER = r"[-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?"
_NUMBERS = re.compile(_NUMBER)


def plan_source(
    file: str,
    *,
    size: tuple[float | None, float | None],
    lower_left: str | None,
    area: str | None,
    scale: str | None,
    points: Sequence[str],
    distance: str | None,
    unit_m: float | None,
    **options: Any,
) -> PlanSource:
    """Put together how a plan is read; raises UsageError where the options cannot be meant so."""
    from pydantic import ValidationError

    from vislam2tag.survey.plans.source import PlanSource

    values: dict[str, Any] = {"file": file, **{name: value for name, value in options.items() if value is not None}}
    corner = None if lower_left is None else _numbers("--lower-left", lower_left, 2, "X,Y in metres")
    width_m, height_m = size
    sized = width_m is not None or height_m is not None
    if sized:
        values["extent"] = {"width_m": width_m, "height_m": height_m} | _corner(corner)
    if area is not None:
        values["area"] = _numbers("--area", area, 4, "X,Y,X,Y, two opposite corners in the plan's units, or page")
    if scale is not None:
        values["scale"] = {"one_to": _scale(scale)} | _corner(corner)
    if points:
        values["points"] = _points(points)
    if distance is not None:
        x0, y0, x1, y1, metres = _numbers("--distance", distance, 5, "X,Y,X,Y,METRES, the points in the plan's units")
        values["distance"] = {"from": (x0, y0), "to": (x1, y1), "metres": metres} | _corner(corner)
    if unit_m is not None:
        values["unit_m"] = unit_m
    if corner is not None and not sized and distance is None and scale is None:
        raise UsageError("--lower-left: goes with --width-m and --height-m, with --distance or with --scale")
    try:
        return PlanSource.model_validate(values)
    except ValidationError as error:
        raise UsageError(_first(error)) from error


def floor_part(**values: Any) -> FloorPart:
    """Describe a floor; raises UsageError for a value that cannot be."""
    from pydantic import ValidationError

    from vislam2tag.survey.site_file import FloorPart

    try:
        return FloorPart(**values)
    except ValidationError as error:
        raise UsageError(_first(error)) from error


def georeference_part(text: str) -> GeoreferencePart:
    """Read ``EPSG:CODE,EASTING,NORTHING[,ROTATION]`` or ``LATITUDE,LONGITUDE[,BEARING]``; raises UsageError."""
    from pydantic import ValidationError

    from vislam2tag.survey.site_file import GeoreferencePart

    system = re.fullmatch(r"EPSG:(\d+),(.*)", text, re.IGNORECASE)
    numbers = _found(system.group(2) if system else text)
    if numbers is None or len(numbers) not in (2, 3):
        raise UsageError(
            f"--georeference {text}: give EPSG:CODE,EASTING,NORTHING,ROTATION or LATITUDE,LONGITUDE,BEARING"
        )
    names = ("easting_m", "northing_m", "rotation_deg") if system else ("latitude_deg", "longitude_deg", "bearing_deg")
    values: dict[str, Any] = dict(zip(names, numbers, strict=False))
    if system:
        values["epsg"] = int(system.group(1))
    try:
        return GeoreferencePart.model_validate(values)
    except ValidationError as error:
        raise UsageError(f"--georeference {text}: {_first(error)}") from error


def _scale(text: str) -> float:
    one, _, number = text.partition(":")
    if one.strip() != "1" or not re.fullmatch(_NUMBER, number.strip()):
        raise UsageError(f"--scale {text}: give 1:N as the drawing says, such as 1:100")
    return float(number)


def _corner(corner: Sequence[float] | None) -> dict[str, Any]:
    return {} if corner is None else {"lower_left_m": tuple(corner)}


def _points(texts: Sequence[str]) -> list[dict[str, Any]]:
    if len(texts) != 2:
        raise UsageError(f"--point: given {len(texts)} times; two known points are needed")
    found = []
    for text in texts:
        plan, _, bcs = text.partition("=")
        shape = "PX,PY=X,Y: the plan's own coordinates, then metres"
        found.append({"plan": _numbers("--point", plan, 2, shape), "bcs_m": _numbers("--point", bcs, 2, shape)})
    return found


def _numbers(option: str, text: str, count: int, shape: str) -> list[float]:
    numbers = _found(text)
    if numbers is None or len(numbers) != count:
        raise UsageError(f"{option} {text}: give {shape}")
    return numbers


def _found(text: str) -> list[float] | None:
    parts = [part.strip() for part in text.split(",")]
    return [float(part) for part in parts] if all(_NUMBERS.fullmatch(part) for part in parts) else None


def _first(error: ValidationError) -> str:
    wrong = error.errors()[0]
    place = ", ".join(str(part) for part in wrong["loc"])
    return f"{place}{': ' if place else ''}{wrong['msg'].removeprefix('Value error, ')}"
