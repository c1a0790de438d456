"""What is written on an SVG: its text elements, where their transforms put them."""

from __future__ import annotations

import re
from collections.abc import Iterator
from xml.etree import ElementTree

import numpy as np

from vislam2tag.core.arrays import FloatArray
from vislam2tag.site.plans.model import PlanText

_TRANSFORM = re.compile(r"(matrix|translate|scale|rotate)\s*\(([^)]*)\)")
_NUMBER = re.compile(r"[+-]?(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d+)?")
_UNSEEN = {"defs", "symbol", "clipPath", "mask", "style", "title", "desc", "metadata"}


def svg_texts(svg: str, height: float) -> tuple[PlanText, ...]:
    """Texts of a drawing, each where it begins, in the view box's coordinates but with y upwards from ``height``.

    None of a file that is no XML, which its drawing tells, or that defines entities.
    """
    if "<!ENTITY" in svg:  # what such a file grows to nobody knows
        return ()
    try:
        root = ElementTree.fromstring(svg)  # noqa: S314 - no entities, in a process whose memory is bounded
    except ElementTree.ParseError:
        return ()
    view = [float(number) for number in _NUMBER.findall(root.get("viewBox", ""))]
    left, top = view[:2] if len(view) == 4 else (0.0, 0.0)
    found = _texts(root, np.array([[1.0, 0.0, -left], [0.0, 1.0, -top], [0.0, 0.0, 1.0]]))
    return tuple(PlanText(text, (float(x), float(height - y))) for text, (x, y) in found)


def _texts(root: ElementTree.Element, view_T_root: FloatArray) -> Iterator[tuple[str, FloatArray]]:
    """Texts below an element with their places (2,), in the file's order; without recursion: groups may be deep."""
    todo = [(root, view_T_root)]
    while todo:
        element, view_T_parent = todo.pop()
        name = str(element.tag).rpartition("}")[2]
        if name in _UNSEEN:
            continue
        view_T_own = view_T_parent @ _transform(element.get("transform", ""))
        if name != "text":
            todo += [(child, view_T_own) for child in reversed(element)]
            continue
        x, y = (next((at for one in element.iter() if (at := _first(one.get(axis)))), 0.0) for axis in ("x", "y"))
        text = " ".join(part.strip() for part in element.itertext() if part.strip())
        if text:
            yield text, (view_T_own @ (x, y, 1.0))[:2]


def _first(lengths: str | None) -> float:
    """The first of an attribute's numbers; 0 where there is none."""
    found = _NUMBER.search(lengths or "")
    return float(found.group()) if found else 0.0


def _transform(text: str) -> FloatArray:
    """The matrix (3, 3) of a ``transform`` attribute; skews, which nobody writes plans with, are left out."""
    whole: FloatArray = np.eye(3)
    for kind, inner in _TRANSFORM.findall(text):
        whole = whole @ _matrix(kind, [float(number) for number in _NUMBER.findall(inner)])
    return whole


def _matrix(kind: str, values: list[float]) -> FloatArray:
    match kind, values:
        case "matrix", [a, b, c, d, e, f]:
            return np.array([[a, c, e], [b, d, f], [0.0, 0.0, 1.0]])
        case "translate", [x, *rest]:
            return np.array([[1.0, 0.0, x], [0.0, 1.0, rest[0] if rest else 0.0], [0.0, 0.0, 1.0]])
        case "scale", [x, *rest]:
            return np.diag([x, rest[0] if rest else x, 1.0])
        case "rotate", [degrees, *centre]:
            turn = np.deg2rad(degrees)
            about = np.array([*centre[:2], 0.0, 0.0])[:2]
            matrix = np.eye(3)
            matrix[:2, :2] = [[np.cos(turn), -np.sin(turn)], [np.sin(turn), np.cos(turn)]]
            matrix[:2, 2] = about - matrix[:2, :2] @ about
            return matrix
    return np.eye(3)
