"""SVG plans: drawings as pictures, with the texts written on them."""

from __future__ import annotations

import io
import re
from collections.abc import Iterator
from pathlib import Path
from xml.etree import ElementTree

import numpy as np
from PIL import Image

from vislam2tag.core.arrays import FloatArray
from vislam2tag.site.plans.drawing import PlanDrawing, PlanFormat, file_bytes, register
from vislam2tag.site.plans.images import on_paper
from vislam2tag.site.plans.source import PlanSource, PlanText

_ROOT = re.compile(r"<svg\b[^>]*>", re.DOTALL)
_LENGTH = re.compile(r"([0-9.]+(?:e[+-]?[0-9]+)?)\s*([a-z]*)", re.IGNORECASE)
_INCH_M = 0.0254
_PIXEL_M = _INCH_M / 96
"""Of CSS; programs write it for any size, so that it has none on paper."""
_UNITS_M = {"mm": 1e-3, "cm": 1e-2, "in": _INCH_M, "pt": _INCH_M / 72, "pc": _INCH_M / 6}
_LONGEST_PAPER_M = 5.0
"""What is larger was drawn in the building's own size."""
_ASPECT_TOLERANCE = 0.01


def read_svg(path: Path, source: PlanSource) -> PlanDrawing:
    """Read the size; the drawing is made when it is asked for.

    Vector drawings; coordinates are those of the ``viewBox`` (without one, CSS pixels) from its upper left corner
    downwards. Text is not drawn, since what it would look like depends on the machine's fonts, but read.
    """
    import resvg_py  # of an extra

    del source
    text = file_bytes(path).decode("utf-8-sig", errors="replace")
    width, height, paper_m = _size(text)
    in_true_size = paper_m is not None and max(width, height) * paper_m > _LONGEST_PAPER_M

    def picture(side_px: int) -> Image.Image:
        zoom = side_px / max(width, height)
        try:
            data = resvg_py.svg_to_bytes(
                svg_string=text,
                width=max(1, round(width * zoom)),
                height=max(1, round(height * zoom)),
                skip_system_fonts=True,
                dpi=96,
            )
        except ValueError as error:
            raise OSError("cannot be read as SVG") from error
        return on_paper(Image.open(io.BytesIO(data)), side_px)

    return PlanDrawing(
        (0.0, width, 0.0, height),
        picture,
        downwards=True,
        unit_m=paper_m if in_true_size else None,
        paper_m=None if in_true_size else paper_m,
        texts=svg_texts(text, height),
    )


def _size(text: str) -> tuple[float, float, float | None]:
    """Width and height of the view box, else of the drawing, and metres on paper a unit, if lengths show it."""
    root = _ROOT.search(text)
    if root is None:
        raise OSError("cannot be read as SVG")
    attributes = dict(re.findall(r"""(?<![\w:-])(width|height|viewBox)\s*=\s*["']([^"']*)["']""", root.group()))
    lengths = [_length(attributes.get(name, "")) for name in ("width", "height")]
    across_px, up_px = (number * _UNITS_M[unit] / _PIXEL_M if unit in _UNITS_M else number for number, unit in lengths)
    view = attributes.get("viewBox", "").replace(",", " ").split()
    width, height = (_length(each)[0] for each in view[2:]) if len(view) == 4 else (across_px, up_px)
    if not width or not height:
        raise OSError("has no size: its svg element needs a viewBox")
    if not across_px or not up_px:
        return width, height, None
    if abs(across_px * height / (up_px * width) - 1) > _ASPECT_TOLERANCE:
        raise OSError("has a width and height with a different aspect ratio than its viewBox; correct one of them")
    on_paper_too = all(unit in _UNITS_M for _, unit in lengths)
    return width, height, across_px * _PIXEL_M / width if on_paper_too else None


def _length(text: str) -> tuple[float, str]:
    """A length's number and unit; 0 where there is none or it is a share."""
    found = _LENGTH.fullmatch(text.strip())
    try:
        return (float(found.group(1)), found.group(2).lower()) if found else (0.0, "")
    except ValueError:
        return 0.0, ""


register(PlanFormat("svg", (".svg",), read_svg, options=("area",)))


_TRANSFORM = re.compile(r"(matrix|translate|scale|rotate)\s*\(([^)]*)\)")
_NUMBER = re.compile(r"[+-]?(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d+)?")
_UNSEEN = {"defs", "symbol", "clipPath", "mask", "style", "title", "desc", "metadata"}


def svg_texts(svg: str, height: float) -> tuple[PlanText, ...]:
    """Texts of a drawing, each where it begins, in the view box's coordinates but with y upwards from ``height``.

    None of a file that is not XML, which its drawing reports, or that defines entities.
    """
    if "<!ENTITY" in svg:  # what such a file grows to no one knows
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
    """The matrix (3, 3) of a ``transform`` attribute; skews, which no one writes plans with, are left out."""
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
