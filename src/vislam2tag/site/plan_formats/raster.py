"""Plans that are photographs, scans or drawings in pixels: PNG, JPG and what else Pillow reads."""

from __future__ import annotations

import io
import warnings
from pathlib import Path

from PIL import Image

from vislam2tag.site.plans.drawing import PlanDrawing, PlanFormat, file_bytes, register
from vislam2tag.site.plans.images import load_plan, on_paper
from vislam2tag.site.plans.source import PlanSource

IMAGES = (".png", ".jpg", ".jpeg", ".tif", ".tiff", ".bmp", ".gif", ".webp")


def read_image(path: Path, source: PlanSource) -> PlanDrawing:
    """Read the size; pixels are decoded when they are asked for.

    Images; coordinates are pixels from the upper left corner of the image downwards.
    """
    del source
    data = file_bytes(path)
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # as where the pixels are loaded
            with Image.open(io.BytesIO(data)) as image:
                width, height = image.size
    except Image.DecompressionBombError as error:
        raise OSError("has too many pixels") from error
    except (OSError, SyntaxError, ValueError) as error:
        raise OSError("cannot be read as an image") from error

    def picture(side_px: int) -> Image.Image:
        return on_paper(load_plan(path, side_px), side_px)

    return PlanDrawing((0.0, float(width), 0.0, float(height)), picture, downwards=True, pixels=True)


register(PlanFormat("raster", IMAGES, read_image, options=("area",)))
