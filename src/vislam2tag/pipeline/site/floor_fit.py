"""Whether a floor fits the others of its building, and the command that makes it fit."""

from __future__ import annotations

import math
import shlex
from pathlib import Path

from vislam2tag.common.files.given_files import AnyPath
from vislam2tag.intake.extents import Box, FloorFit, floor_fit
from vislam2tag.site.discover import read_site
from vislam2tag.site.model import Floor

_ODD = (FloorFit.OTHER_SIZE, FloorFit.OTHER_SHAPE)


def floor_fit_notes(root: AnyPath, number: int) -> list[str]:
    """Sentences about a floor whose place or size does not fit the other floors, with the command to run.

    Empty if it fits, or if there is no other floor with a plan. Raises SurveyError if the site cannot be read.
    """
    root = Path(root)
    floors = {floor.number: floor for floor in read_site(root)[0].floors if floor.extent_m is not None}
    new = floors.pop(number, None)
    if new is None or not floors:
        return []
    others = sorted(floors.values(), key=lambda each: (abs(each.number - number), each.number))
    own = _shared_box(new)
    fits = {each.number: floor_fit(own, _shared_box(each)) for each in others}
    if all(fit is FloorFit.APART for fit in fits.values()):
        return [_apart(root, new, others[0])]
    if FloorFit.FITS in fits.values():
        return []
    odd = [each for each in others if fits[each.number] in _ODD and each.site_T_bcs == new.site_T_bcs]
    return [_other_size(root, new, odd[0], fits[odd[0].number])] if odd else []


def _shared_box(floor: Floor) -> Box:
    """Left, right, lower and upper edge of a floor's plan in the frame that all floors share, metres."""
    assert floor.extent_m is not None
    left, right, low, high = floor.extent_m
    corners = [complex(x, y) for x in (left, right) for y in (low, high)]
    placed = [floor.site_T_bcs.a * corner + floor.site_T_bcs.b for corner in corners]
    x, y = [each.real for each in placed], [each.imag for each in placed]
    return min(x), max(x), min(y), max(y)


def _apart(root: Path, new: Floor, other: Floor) -> str:
    """Move the one that is further from the origin: its plan has coordinates of a larger area."""
    far, near = sorted((new, other), key=lambda floor: -math.hypot(*floor.lower_left_m))
    (x, y), corner = far.lower_left_m, "{:g},{:g}".format(*near.lower_left_m)
    return (
        f"floor {far.number} begins at ({x:,.0f}, {y:,.0f}) m and is not above or below floor {near.number}, which "
        f"begins at ({near.lower_left_m[0]:,.0f}, {near.lower_left_m[1]:,.0f}) m. To move it, run vislam2tag site set "
        f"{shlex.quote(str(root))} --floor {far.number} --lower-left {corner}"
    )


def _other_size(root: Path, new: Floor, other: Floor, fit: FloorFit) -> str:
    site = shlex.quote(str(root))
    sizes = (
        f"floor {new.number} is {new.width_m:.1f} m x {new.height_m:.1f} m and floor {other.number} "
        f"{other.width_m:.1f} m x {other.height_m:.1f} m"
    )
    if fit is FloorFit.OTHER_SIZE:
        return (
            f"{sizes}, in the same shape: check the sizes. To correct this one, run vislam2tag site set {site} --floor "
            f"{new.number} --width-m {other.width_m:.2f}"
        )
    return (
        f"{sizes}, and both begin at the same corner. If the drawings do not begin at the same place of the building, "
        f"run vislam2tag site align {site} --floor {new.number} --onto {other.number} --page align.html"
    )
