"""Parts of a drawing that wide gaps separate: the building, storeys beside it, and what was left far away."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from vislam2tag.core.arrays import FloatArray, IntArray
from vislam2tag.site.plans.drawing import Bounds
from vislam2tag.site.plans.source import Point

_GAP_M = 4.0
"""Parts closer than this are one: no wall crosses a wide entrance or a row of windows."""
_GAP_SHARE = 0.02
"""Of the drawing's size, where that is more, or the unit is not known."""
_MIDDLE = (5.0, 95.0)
"""Percentiles of lines that show the drawing's size, whatever is far away."""
_LIKE_SHARE = 1 / 3
_LIKE_AREA = 1 / 4
"""A part with at least these shares of the lines and the area of the largest one may be the drawing as well."""
_LONGEST = 5.0
"""Longer lines count as this many usual ones: one line may cross a country."""
_MOST_NAMED = 8


@dataclass(frozen=True)
class Part:
    """Lines that are near each other."""

    members: IntArray
    """Indices of the lines."""
    box: Bounds
    weight: float
    """Length of its lines."""

    @property
    def side(self) -> float:
        """The longer side of its box."""
        return max(self.box[1] - self.box[0], self.box[3] - self.box[2])

    def distance(self, other: Part) -> float:
        """Distance between its box and that of another part along the axis where they are further apart."""
        (left, right, low, high), (left2, right2, low2, high2) = self.box, other.box
        return max(left2 - right, left - right2, low2 - high, low - high2, 0.0)

    @property
    def area(self) -> float:
        """Area of its box."""
        return (self.box[1] - self.box[0]) * (self.box[3] - self.box[2])

    def is_like(self, other: Part) -> bool:
        """Whether it may be a floor as the other part may be."""
        return self.weight >= _LIKE_SHARE * other.weight and self.area >= _LIKE_AREA * other.area

    def is_near(self, point: Point) -> bool:
        """Whether a point is in its box, or closer than its own side."""
        (x, y), (left, right, low, high) = point, self.box
        return max(left - x, x - right, low - y, y - high) <= self.side


def building_and_strays(lines: Sequence[FloatArray], unit_m: float | None) -> tuple[Part, list[Part]]:
    """Find the building among lines (k, 2), with what is near it, and the parts that are far away from it.

    ``unit_m``: metres a unit, if known. Raises OSError, whose text completes a sentence about the file and says what
    to do, if several parts could be the building.
    """
    boxes = np.array([_box(line) for line in lines])
    gap = _gap(boxes, unit_m)
    parts = sorted(_parts(lines, boxes, gap), key=lambda part: -part.weight)
    main = parts[0]
    alike = [part for part in parts if part.is_like(main)]
    if len(alike) > 1:
        raise OSError(_choice(alike, gap, unit_m))
    strays = [part for part in parts if part.distance(main) > main.side]
    near = [part for part in parts if part.distance(main) <= main.side]
    members = np.concatenate([part.members for part in near])
    return Part(members, _around(boxes[members]), sum(part.weight for part in near)), strays


def _box(line: FloatArray) -> Bounds:
    (left, low), (right, high) = line.min(axis=0).tolist(), line.max(axis=0).tolist()
    return left, right, low, high


def _around(boxes: FloatArray) -> Bounds:
    left, _, low, _ = boxes.min(axis=0).tolist()
    _, right, _, high = boxes.max(axis=0).tolist()
    return left, right, low, high


def _gap(boxes: FloatArray, unit_m: float | None) -> float:
    middles = (boxes[:, [0, 2]] + boxes[:, [1, 3]]) / 2
    low, high = np.percentile(middles, _MIDDLE, axis=0)
    return max(_GAP_SHARE * float((high - low).max()), 0.0 if unit_m is None else _GAP_M / unit_m)


def _parts(lines: Sequence[FloatArray], boxes: FloatArray, gap: float) -> list[Part]:
    """Cut at empty bands across what is left, along either axis, as long as there is one."""
    pieces = [np.linalg.norm(np.diff(line, axis=0), axis=1) for line in lines]
    most = _LONGEST * float(np.median(np.concatenate(pieces)))
    lengths = np.array([each.clip(max=most).sum() for each in pieces])
    waiting, found = [np.arange(len(lines))], []
    while waiting:
        members = waiting.pop()
        cuts = (_cut(members, boxes[:, axis : axis + 2], gap) for axis in (0, 2))
        apart = next((cut for cut in cuts if len(cut) > 1), None)
        if apart is None:
            found.append(Part(members, _around(boxes[members]), float(lengths[members].sum())))
        else:
            waiting += apart
    return found


def _cut(members: IntArray, spans: FloatArray, gap: float) -> list[IntArray]:
    """Cut members where none of their spans (n, 2) reaches."""
    order = members[np.argsort(spans[members, 0])]
    reached = np.maximum.accumulate(spans[order, 1])
    return np.split(order, np.flatnonzero(spans[order[1:], 0] - reached[:-1] > gap) + 1)


def _choice(parts: Sequence[Part], gap: float, unit_m: float | None) -> str:
    named = [
        f"{_area(part.box, gap / 4)} ({_size(part.box, unit_m)})"
        for part in sorted(parts, key=lambda part: part.box[::2])[:_MOST_NAMED]
    ]
    return (
        f"shows {len(parts)} drawings beside each other, such as storeys: choose one by --area, from: "
        f"{'; '.join(named)}. If they are parts of one floor, use an area around all of them"
    )


def _area(box: Bounds, margin: float) -> str:
    left, right, low, high = box
    corners = (left - margin, low - margin, right + margin, high + margin)
    return ",".join(f"{corner:.2f}".rstrip("0").rstrip(".") for corner in corners)


def _size(box: Bounds, unit_m: float | None) -> str:
    width, height = ((box[1] - box[0]) * (unit_m or 1.0), (box[3] - box[2]) * (unit_m or 1.0))
    return f"{width:.4g} x {height:.4g} units" if unit_m is None else f"{width:.4g} m x {height:.4g} m"
