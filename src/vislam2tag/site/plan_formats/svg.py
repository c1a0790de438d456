"""SVG plans, drawn by resvg."""

from __future__ import annotations

import io
import re
from pathlib import Path

from PIL import Image

from vislam2tag.site.plans.drawing import PlanDrawing, file_bytes
from vislam2tag.site.plans.images import on_paper
from vislam2tag.site.plans.registry import register
from vislam2tag.site.plans.source import PlanSource
from vislam2tag.site.plans.svg_text import svg_texts

_ROOT = re.compile(r"<svg\b[^>]*>", re.DOTALL)
_LENGTH = re.compile(r"([0-9.]+(?:e[+-]?[0-9]+)?)\s*([a-z]*)", re.IGNORECASE)
_INCH_M = 0.0254
_PIXEL_M = _INCH_M / 96
"""Of CSS; programs write it for any size, so that it tells none on paper."""
_UNITS_M = {"mm": 1e-3, "cm": 1e-2, "in": _INCH_M, "pt": _INCH_M / 72, "pc": _INCH_M / 6}
_LONGEST_PAPER_M = 5.0
"""What is larger was drawn in the building's own size."""
_ASPECT_TOLERANCE = 0.01


class SvgFormat:
    """Vector drawings; coordinates are those of the ``viewBox`` (without one, CSS pixels) from its upper left corner
    downwards.

    Text is not drawn, since what it would look like depends on the machine's fonts, but read.
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
    """Width and height of the view box, else of the drawing, and metres on paper a unit where lengths tell."""
    root = _ROOT.search(text)
    if root is None:
        raise OSError("cannot be read as SVG")
    attributes = dict(re.findall(r"""(?<![\w:-])(width|height|viewBox)\s*=\s*["']([^"']*)["']""", root.group()))
    lengths = [_length(attributes.get(name, "")) for name in ("width", "height")]
    across_px, up_px = (number * _UNITS_M[unit] / _PIXEL_M if unit in _UNITS_M else number for number, unit in lengths)
    view = attributes.get("viewBox", "").replace(",", " ").split()
    width, height = (_length(each)[0] for each in view[2:]) if len(view) == 4 else (across_px, up_px)
    if not width or not height:
        raise OSError("tells no size: its svg element needs a viewBox")
    if not across_px or not up_px:
        return width, height, None
    if abs(across_px * height / (up_px * width) - 1) > _ASPECT_TOLERANCE:
        raise OSError("has a width and height of another shape than its viewBox; correct one of them")
    on_paper_too = all(unit in _UNITS_M for _, unit in lengths)
    return width, height, across_px * _PIXEL_M / width if on_paper_too else None


def _length(text: str) -> tuple[float, str]:
    """A length's number and unit; 0 where there is none or it is a share."""
    found = _LENGTH.fullmatch(text.strip())
    try:
        return (float(found.group(1)), found.group(2).lower()) if found else (0.0, "")
    except ValueError:
        return 0.0, ""


register(SvgFormat())
