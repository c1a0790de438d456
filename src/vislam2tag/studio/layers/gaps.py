"""What of a floor no walk came near yet, and the walk that fills it."""

from __future__ import annotations

import numpy as np

from vislam2tag.common.findings import Severity
from vislam2tag.core.arrays import FloatArray
from vislam2tag.studio.collect.covered import covered
from vislam2tag.studio.layer_registry import register
from vislam2tag.studio.messages import Point
from vislam2tag.studio.work_messages import Feature, Title
from vislam2tag.studio.workspace import Workspace

_WAY = "#a8447f"
"""Of no walk's status."""


class Gaps:
    """Strips of what lacks, a line through them, and its first stop."""

    name = "gaps"
    title = Title(en="Not walked yet, and the way there", de="Noch nicht begangen, und der Weg dorthin")
    shown = False

    def features(self, workspace: Workspace, floor: int) -> list[Feature]:
        """Strips, line and stop of one floor; none where it has no plan that can be walked."""
        record, space = covered(workspace, floor)
        if space is None:
            return []
        step_m = space.distances.step_m
        features = [
            Feature(
                id=f"{self.name}:{floor}:{number}",
                shape="area",
                floor=floor,
                coordinates=strip,
                severity=Severity.WARNING,
            )
            for number, strip in enumerate(strips(space.places_m[~space.walked], step_m))
        ]
        if record.walk is not None:
            line, stop = record.walk.points_m, record.walk.stops_m[0]
            way = Feature(id=f"{self.name}:{floor}:way", shape="line", floor=floor, coordinates=line, colour=_WAY)
            stopped = Feature(id=f"{self.name}:{floor}:next", shape="point", floor=floor, coordinates=[stop], colour=_WAY)
            features += [way, stopped]
        return features


def strips(places_m: FloatArray, step_m: float) -> list[list[Point]]:
    """Rectangles around places (n, 2) of a grid, those beside each other along x in one; corners in order, metres."""
    if not len(places_m):
        return []
    column, row = np.round(places_m / step_m).astype(np.int64).T
    order = np.lexsort((column, row))
    column, row, places_m = column[order], row[order], places_m[order]
    breaks = np.flatnonzero((np.diff(row) != 0) | (np.diff(column) > 1)) + 1
    half = step_m / 2
    found = []
    for part in np.split(places_m, breaks):
        (left, y), right = (part[0] - half).tolist(), float(part[-1, 0] + half)
        found.append([(left, y), (right, y), (right, y + step_m), (left, y + step_m)])
    return found


register(Gaps())
