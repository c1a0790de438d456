"""The drawn plan image of a generated floor."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from PIL import Image, ImageDraw

from vislam2tag.simulation.model import SimulatedFloor


def draw_plan(floor: SimulatedFloor, path: Path, pixels_per_m: float = 20.0) -> None:
    """Write the floor's walls as an image (format from the suffix) that covers exactly width x height metres."""
    size = (round(floor.width_m * pixels_per_m), round(floor.height_m * pixels_per_m))
    image = Image.new("RGB", size, "white")
    canvas = ImageDraw.Draw(image)
    limit = np.array(size) - 1
    pixels = np.stack((floor.walls[..., 0], floor.height_m - floor.walls[..., 1]), axis=-1) * pixels_per_m
    for start, stop in pixels.clip(0, limit).tolist():
        canvas.line((*start, *stop), fill=(60, 60, 60), width=max(1, round(0.12 * pixels_per_m)))
    image.save(path, quality=88) if path.suffix.lower() in {".jpg", ".jpeg"} else image.save(path)
