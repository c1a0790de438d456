"""SVG plans, drawn by resvg."""

from __future__ import annotations

import io
import re
from pathlib import Path

from PIL import Image

from vislam2tag.survey.plans.drawing import PlanDrawing, file_bytes
from vislam2tag.survey.plans.images import on_paper
from vislam2tag.survey.plans.registry import register
from vislam2tag.survey.plans.source import PlanSource

_ROOT = re.compile(r"<svg\b[^>]*>", re.DOTALL)
_LENGTH = re.compile(r"([0-9.]+(?:e[+-]?[0-9]+)?)\s*(?:[a-z]*)", re.IGNORECASE)
_ASPECT_TOLERANCE = 0.01


class SvgFormat:
    """Vector drawings; coordinates are those of the ``viewBox`` from its upper left corner downwards.

    Text is not drawn: what it would look like depends on the machine's fonts.
    """

    name = "svg"
    suffixes: tuple[str, ...] = (".svg",)

    def recognises(self, path: Path) -> bool:
        """The suffix tells."""
        return path.is_file()

    def read(self, path: Path, source: PlanSource) -> PlanDrawing:
        """Read the size; the drawing is made when it is asked for."""
        import resvg_py  # of an extra

        del source
        text = file_bytes(path).decode("utf-8-sig", errors="replace")
        width, height = _size(text)

        def picture(side_px: int) -> Image.Image:
            zoom = side_px / max(width, height)
            try:
                data = resvg_py.svg_to_bytes(
                    svg_string=text,
                    width=max(1, round(width * zoom)),
                    height=max(1, round(height * zoom)),
                    skip_system_fonts=True,
                )
            except ValueError as error:
                raise OSError("cannot be read as SVG") from error
            return on_paper(Image.open(io.BytesIO(data)), side_px)

        return PlanDrawing((0.0, width, 0.0, height), picture, downwards=True)


def _size(text: str) -> tuple[float, float]:
    """Width and height of the view box, else of the drawing."""
    root = _ROOT.search(text)
    if root is None:
        raise OSError("cannot be read as SVG")
    attributes = dict(re.findall(r"""\b(width|height|viewBox)\s*=\s*["']([^"']*)["']""", root.group()))
    size = [_number(attributes.get(name, "")) for name in ("width", "height")]
    view = attributes.get("viewBox", "").replace(",", " ").split()
    if len(view) == 4:
        width, height = _number(view[2]), _number(view[3])
    else:
        width, height = size
    if not width or not height:
        raise OSError("tells no size: its svg element needs a viewBox")
    if size[0] and size[1] and abs(size[0] * height / (size[1] * width) - 1) > _ASPECT_TOLERANCE:
        raise OSError("has a width and height of another shape than its viewBox; correct one of them")
    return width, height


def _number(text: str) -> float:
    """A length's number, 0 where there is none or it is a share."""
    found = None if "%" in text else _LENGTH.fullmatch(text.strip())
    try:
        return float(found.group(1)) if found else 0.0
    except ValueError:
        return 0.0


register(SvgFormat())
