"""The floor plan as a small image inside the page."""

from __future__ import annotations

import base64
import io
import warnings
from pathlib import Path

from PIL import Image

MAX_PIXELS = 1400
"""Longer side of the embedded plan, pixels."""

_JPEG_QUALITY = 80


def plan_data_uri(path: Path) -> str | None:
    """Return the plan image, scaled to at most :data:`MAX_PIXELS`, as a JPEG data URI; None where it is unreadable."""
    try:
        with warnings.catch_warnings():
            # A huge plan is no attack here: it is the surveyor's own file.
            warnings.simplefilter("ignore", Image.DecompressionBombWarning)
            image = _scaled(path)
    except (OSError, ValueError, SyntaxError, Image.DecompressionBombError):
        return None
    buffer = io.BytesIO()
    image.save(buffer, "JPEG", quality=_JPEG_QUALITY, optimize=True)
    return "data:image/jpeg;base64," + base64.b64encode(buffer.getvalue()).decode("ascii")


def _scaled(path: Path) -> Image.Image:
    """Load the image on white ground, downscaled."""
    with Image.open(path) as original:
        # JPEG decodes at a fraction of its size when asked before loading.
        original.draft("RGB", (MAX_PIXELS, MAX_PIXELS))
        coloured = original.convert("RGBA")
    coloured.thumbnail((MAX_PIXELS, MAX_PIXELS), Image.Resampling.LANCZOS)
    paper = Image.new("RGB", coloured.size, "white")
    paper.paste(coloured, mask=coloured.getchannel("A"))
    return paper
