"""Loading a floor's plan image."""

from __future__ import annotations

import warnings
from pathlib import Path

from PIL import Image

_FORMATS = ("JPEG", "PNG", "BMP", "GIF", "TIFF", "WEBP")


def load_plan(path: Path, side_px: int) -> Image.Image:
    """Return a plan with all its pixels in memory.

    A JPEG is decoded at the smallest fraction of its size whose sides are still at least ``side_px``, any other
    format in full. Raises OSError, whose text completes a sentence about the file, where it is no whole image (JPEG,
    PNG, BMP, GIF, TIFF or WebP) or has more pixels than Pillow takes.
    """
    try:
        with warnings.catch_warnings():
            # A huge plan is no attack here, and odd metadata no harm: it is the surveyor's own file.
            warnings.simplefilter("ignore")
            with Image.open(path, formats=_FORMATS) as image:
                image.draft("RGB", (side_px, side_px))
                image.load()
                return image
    except Image.DecompressionBombError as error:
        raise OSError("has too many pixels") from error
    except (OSError, ValueError, SyntaxError) as error:
        raise OSError("cannot be read as an image") from error


def on_paper(plan: Image.Image, side_px: int) -> Image.Image:
    """Return a plan on white ground, scaled down to at most ``side_px`` along its longer side."""
    coloured = plan.convert("RGBA")
    coloured.thumbnail((side_px, side_px), Image.Resampling.LANCZOS)
    paper = Image.new("RGB", coloured.size, "white")
    paper.paste(coloured, mask=coloured.getchannel("A"))
    return paper
