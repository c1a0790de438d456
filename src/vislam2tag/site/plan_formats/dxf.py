"""DXF plans: lines and filled shapes of the layers that contain walls; doors stay open."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from vislam2tag.core.arrays import FloatArray
from vislam2tag.intake.extents import unit_doubt, unit_fits
from vislam2tag.site.dxf.entities import Drawn, drawn_entities, open_dxf
from vislam2tag.site.dxf.layers import Kind, kind_of
from vislam2tag.site.dxf.roles import Role, guesses_walls, roles_of, usual_swing
from vislam2tag.site.plans.drawing import PlanDrawing, PlanFormat, bounds_of, cropped, file_bytes, register
from vislam2tag.site.plans.features import segments
from vislam2tag.site.plans.parts import building_and_strays
from vislam2tag.site.plans.source import SCALES, PlanSource
from vislam2tag.site.plans.taken_parts import Became, TakenPart

_SAG_M = 0.01
"""How far a curve's pieces may be from it."""
_MOST_NAMED = 5


def read_dxf(path: Path, source: PlanSource) -> PlanDrawing:
    """Read the model space.

    CAD drawings, text or binary; coordinates are the file's, whose header defines the unit.
    """
    document = open_dxf(file_bytes(path))
    stated_m = _stated_unit_m(document)
    unit_m = source.unit_m or stated_m
    drawn = drawn_entities(document, _SAG_M / (unit_m or 1.0))
    if not drawn.lines:
        raise OSError(_why_empty(drawn))
    roles = roles_of(drawn, source, unit_m)
    notes = [*_unread(drawn, source), *_guessed(drawn, roles, source)]
    if source.area is None:
        notes += _without_strays(drawn, roles, unit_m)
    drawing = _drawing(drawn, roles, stated_m)
    if source.area is not None:
        (left, right), (low, high) = sorted(source.area[::2]), sorted(source.area[1::2])
        drawing = cropped(drawing, (left, right, low, high))
    door = usual_swing(drawn.lines, roles)
    given = source.epsg is not None or any(getattr(source, scale) is not None for scale in SCALES)
    if stated_m is not None and not given:
        notes += _doubted_unit(document, drawing, door)
    return PlanDrawing(**vars(drawing) | {"door": door, "taken": _taken(drawn, roles), "notes": tuple(notes)})


def _stated_unit_m(document: Any) -> float | None:
    """Metres a unit as the header says, None if it does not."""
    from ezdxf import units
    from ezdxf.enums import InsertUnits

    try:
        code = int(document.header.get("$INSUNITS", 0))
        return float(units.conversion_factor(InsertUnits(code), InsertUnits.Meters)) if code else None
    except (ValueError, KeyError) as error:
        raise OSError("cannot be read as DXF") from error


def _doubted_unit(document: Any, drawing: PlanDrawing, door: float | None) -> list[str]:
    """Note a unit that may be wrong; raises OSError, whose text completes a sentence, for one that cannot be right."""
    left, right, low, high = drawing.bounds
    sides, unit_m = (right - left, high - low), drawing.unit_m
    assert unit_m is not None
    doubt = unit_doubt(sides, door, unit_m, metric=document.header.get("$MEASUREMENT", 0) == 1)
    if doubt and not unit_fits(sides, door, unit_m):
        raise OSError(f"says in its header that {doubt}")
    return [f"the header says that {doubt}"] if doubt else []


def _without_strays(drawn: Drawn, roles: list[Role], unit_m: float | None) -> Iterator[str]:
    """Leave out what is far from the building, and note it."""
    taken = [number for number, role in enumerate(roles) if role.became is not Became.LEFT_OUT]
    building, strays = building_and_strays([drawn.lines[number].points for number in taken], unit_m)
    for stray in strays:
        numbers = [taken[member] for member in stray.members.tolist()]
        layers = ", ".join(sorted({drawn.lines[number].layer for number in numbers}))
        away = stray.distance(building)
        far = f"{away:,.0f} units" if unit_m is None else f"{away * unit_m:,.0f} m"
        yield (
            f"left out, because it is {far} from the building: {len(numbers)} of the lines on layer {layers}, at "
            f"({stray.box[0]:.10g}, {stray.box[2]:.10g}); choose the part that counts by --area if that is wrong"
        )
        for number in numbers:
            roles[number] = Role(Became.LEFT_OUT, "far from the building")
    drawn.texts = [(layer, text) for layer, text in drawn.texts if building.is_near(text.place_m)]


def _drawing(drawn: Drawn, roles: Sequence[Role], unit_m: float | None) -> PlanDrawing:
    walls, doors = (_segments(drawn, roles, became) for became in (Became.WALLS, Became.DOORS))
    bounds = bounds_of(np.concatenate([walls.reshape(-1, 2), doors.reshape(-1, 2)]))
    texts = tuple(text for _, text in drawn.texts)
    return PlanDrawing(bounds, walls=walls, doors=doors, texts=texts, unit_m=unit_m)


def _segments(drawn: Drawn, roles: Sequence[Role], became: Became) -> FloatArray:
    """Segments (w, 2, 2) of the lines that became something, without those of no length."""
    lines = [line.points for line, role in zip(drawn.lines, roles, strict=True) if role.became is became]
    pieces = np.concatenate([np.empty((0, 2, 2)), *map(segments, lines)])
    kept: FloatArray = pieces[(pieces[:, 0] != pieces[:, 1]).any(axis=1)]
    return kept


def _taken(drawn: Drawn, roles: Sequence[Role]) -> tuple[TakenPart, ...]:
    """Count lines, texts and what is left out, by layer."""
    counts = Counter((line.layer, role) for line, role in zip(drawn.lines, roles, strict=True))
    counts.update((layer, Role(Became.TEXT)) for layer, _ in drawn.texts)
    for (layer, why), count in drawn.hidden.items():
        counts[layer, Role(Became.LEFT_OUT, why)] += count
    for (layer, kind), count in drawn.unread.items():
        counts[layer, Role(Became.LEFT_OUT, f"{kind} cannot be read")] += count
    ordered = sorted(counts.items(), key=lambda item: (list(Became).index(item[0][1].became), item[0][0]))
    return tuple(TakenPart(layer, role.became, count, role.why) for (layer, role), count in ordered)


def _why_empty(drawn: Drawn) -> str:
    """Why a drawing shows nothing, the end of a sentence."""
    if drawn.hidden:
        named = ", ".join(sorted({f"{layer} ({why})" for layer, why in drawn.hidden})[:_MOST_NAMED])
        return f"shows nothing: all that it contains is hidden, on {named}; make it visible and save it again"
    missing = "".join(f"; {each}" for each in _missing(drawn))
    return f"contains no line, polyline or arc in its model space{missing}"


def _missing(drawn: Drawn) -> Iterator[str]:
    for name in sorted(drawn.missing)[:_MOST_NAMED]:
        yield f"the drawing {name}, which it refers to, is not in the file: bind it (XREF, Bind) and save it again"


def _unread(drawn: Drawn, source: PlanSource) -> Iterator[str]:
    """Note what could be walls and cannot be read."""
    yield from _missing(drawn)
    built = (Kind.WALL, Kind.PART, Kind.UNKNOWN) if guesses_walls(drawn, source) else (Kind.WALL, Kind.PART)
    for (layer, kind), count in sorted(drawn.unread.items()):
        if kind_of(layer) in built or kind.startswith("AEC"):
            yield (
                f"{count} objects of type {kind} on layer {layer} cannot be read; if they are walls, explode them to "
                "lines (EXPLODE) and save the drawing again"
            )


def _guessed(drawn: Drawn, roles: Sequence[Role], source: PlanSource) -> Iterator[str]:
    """Note layers of which it is not clear whether they contain walls."""
    pairs = list(zip(drawn.lines, roles, strict=True))
    of_walls = Counter(line.layer for line, role in pairs if role.became is Became.WALLS)
    if guesses_walls(drawn, source):
        guessed = sorted(layer for layer in of_walls if kind_of(layer) is Kind.UNKNOWN)
        if len(guessed) > 1:
            yield (
                f"no layer is called after walls, so all lines on {', '.join(guessed)} became walls; if some are not, "
                "choose the layers of walls by --walls"
            )
        return
    others = Counter(line.layer for line, role in pairs if role.why == Kind.UNKNOWN.value)
    for layer, count in others.items():
        if count > of_walls.total():
            yield (
                f"layer {layer} contains more lines ({count}) than all walls ({of_walls.total()}) and is left out, "
                "because its name has no word for walls; choose the layers of walls by --walls if it contains some"
            )


register(PlanFormat("dxf", (".dxf",), read_dxf, options=("layers", "doors", "ignore", "epsg", "area")))
