"""A floor of a data set as figures and pages draw it."""

from __future__ import annotations

import numpy as np

from vislam2tag.dataset.model import Dataset
from vislam2tag.survey.model import ControlPoints, Floor


def floor_of(dataset: Dataset, building: str, number: int) -> Floor:
    """Return a floor with its plan where the data set has one; without extent where the manifest has no such floor."""
    points = ControlPoints((), np.zeros((0, 2)))
    for floor in dataset.info.floors:
        if (floor.building, floor.number) == (building, number):
            plan = dataset.files.get(floor.plan) if floor.plan else None
            name = floor.name or f"floor {number}"
            extent = floor.width_m, floor.height_m, floor.elevation_m, plan
            return Floor(number, name, *extent, points, floor.lower_left_m, georeference=floor.georeference)
    return Floor(number, f"floor {number}", None, None, None, None, points)
