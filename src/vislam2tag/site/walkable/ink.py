"""Walls in the picture of a plan: ink, without hairlines, lettering and hatching."""

from __future__ import annotations

import cv2
import numpy as np
import numpy.typing as npt
from skimage.filters import apply_hysteresis_threshold, threshold_otsu
from skimage.morphology import skeletonize

from vislam2tag.common.errors import SurveyError
from vislam2tag.core.arrays import BoolArray, IntArray
from vislam2tag.core.cell_grid import CellGrid, continuing_walls
from vislam2tag.site.plans.source import FloorPlan
from vislam2tag.site.settings import WalkableSettings
from vislam2tag.site.walkable.coloured import ColouredLines, coloured_lines
from vislam2tag.site.walkable.door_swings import without_swings
from vislam2tag.site.walkable.hatching import hatching
from vislam2tag.site.walkable.painted_cells import clearance_px, parts_of, regions, widened

Bytes = npt.NDArray[np.uint8]

STROKE_SHARE = 0.4
"""Strokes thinner than this share of the walls' usual thickness are not walls: door swings, dimensions, text."""
SYMBOL_M = 2.0
"""Ink that touches nothing else and fits into a square of this side is not a wall: text, furniture; metres."""
SWING_M = (0.5, 1.4)
"""Quarter circles with a radius in this range are swings of doors, metres."""
FAINTEST = 32
"""Ink that differs from the paper by less (of 255) is paper: noise of JPEG, light fills."""
_LEAST_SHARE = 1e-4
"""A plan with less ink than this share of its pixels shows nothing."""
_OWN_SHARE = 0.1
"""Less faint ink than this share of the strong one is text or noise."""
_FILL_SHARE = 0.02
"""Of lines less than this share is further off an edge than a line's half width."""
_LINE_PX = 4.0
"""Lines may be so wide at least, pixels."""
_LOOKED_AT = 500_000
"""Colours of areas are looked for among about so many pixels."""
_FREQUENT, _IN_AREAS, _AREA_M = 0.005, 0.6, 1.0
"""Share of the pixels with the colour of an area, share of them in wide areas, and their width, metres."""
_WEIGHTS = np.array([0.299, 0.587, 0.114])


def ink_on_paper(image: Bytes) -> Bytes:
    """How much each pixel of an image (rows, columns, 3) differs in lightness from the paper (0 to 255).

    The paper is the image's most frequent colour, so white lines on black are ink, too.
    """
    light = (image @ _WEIGHTS.astype(np.float32)).astype(np.int16)
    return np.abs(light - round(float(_paper_colour(image) @ _WEIGHTS))).clip(0, 255).astype(np.uint8)


def without_areas(image: Bytes, ink: Bytes, area_px: float) -> Bytes:
    """Leave out of an image's ink (rows, columns) the vivid colours of wide areas: departments, not walls.

    Areas are at least ``area_px`` wide; a colour counts if most of it is in such areas.
    """
    step = max(1, round((ink.size / _LOOKED_AT) ** 0.5))
    some = image[::step, ::step]
    wide = np.ones((max(1, round(area_px / step)),) * 2, dtype=np.uint8)
    left = ink.copy()
    for colour in _vivid_colours(some):
        alike = _alike(some, colour).astype(np.uint8)
        if cv2.morphologyEx(alike, cv2.MORPH_OPEN, wide).sum() >= _IN_AREAS * max(int(alike.sum()), 1):
            own = _alike(image, colour)
            # Seams are between the colour and the paper; walls are darker.
            left[widened(own) & (ink <= ink[own].max(initial=0))] = 0
    return left


def _vivid_colours(image: Bytes) -> list[IntArray]:
    """The vivid ones (3,) of an image's frequent colours."""
    red, green, blue = np.moveaxis(image >> 4, 2, 0).astype(np.int32)
    count = np.bincount(((red << 8) + (green << 4) + blue).ravel(), minlength=4096)
    colours = [np.array((bin_ >> 8, bin_ >> 4 & 15, bin_ & 15)) * 16 + 8 for bin_ in np.flatnonzero(count).tolist()]
    often = (count[count > 0] >= _FREQUENT * count.sum()).tolist()
    return [colour for colour, each in zip(colours, often, strict=True) if each and np.ptp(colour) >= _UNLIKE]


def _alike(image: Bytes, colour: IntArray) -> BoolArray:
    """Which pixels (rows, columns) of an image have about a colour (3,)."""
    low, high = np.clip(colour - _ALIKE, 0, 255), np.clip(colour + _ALIKE, 0, 255)
    return np.asarray(cv2.inRange(np.ascontiguousarray(image), low, high)) > 0


def reduced(ink: Bytes, shape: tuple[int, int]) -> Bytes:
    """Ink on fewer pixels (rows, columns), each with the darkest of what falls into it, so that thin lines stay."""
    reach = tuple(int(np.ceil(old / new)) for old, new in zip(ink.shape, shape, strict=True))
    darkest = np.asarray(cv2.dilate(ink, np.ones(reach, dtype=np.uint8)))
    return np.asarray(cv2.resize(darkest, shape[::-1], interpolation=cv2.INTER_NEAREST), dtype=np.uint8)


def _paper_colour(image: Bytes) -> Bytes:
    """The most frequent (3,) of 16 x 16 x 16 colours."""
    coarse = (image >> 4).astype(np.int32)
    colour = (coarse[..., 0] << 8) + (coarse[..., 1] << 4) + coarse[..., 2]
    most = int(np.bincount(colour.ravel(), minlength=4096).argmax())
    return np.asarray(image[colour == most].mean(axis=0).round().astype(np.uint8))


def walls_in(ink: Bytes, contrast: float | None, line_px: float) -> BoolArray:
    """Return which pixels (rows, columns) are walls: by a contrast (0 to 1) or, without one, by Otsu's threshold among
    all ink.

    Otsu's threshold parts walls from fills; where the fainter part is lines (thinner than ``line_px``), it is walls as
    well. Where there are no fills, fainter ink, down to half of the threshold, counts where it continues strong ink:
    thin lines are grey between pixels. Raises SurveyError where nothing stands out.
    """
    some = ink > (FAINTEST if contrast is None else contrast * 255)
    if some.mean() < _LEAST_SHARE:
        raise SurveyError(
            "the plan's image shows no walls; expected walls that are much darker (or lighter) than the floor "
            "between them. Use another image, a lower wall contrast or polygons"
        )
    if contrast is not None:
        return np.asarray(some)
    strong = _otsu(ink[some])
    fainter = some & (ink <= strong)
    while (own := _own(fainter, ink > strong)).any() and _is_lines(own, line_px):
        strong = _otsu(ink[fainter])
        fainter = some & (ink <= strong)
    weak = strong if own.any() else max(strong / 2, FAINTEST)
    return np.asarray(apply_hysteresis_threshold(ink, weak, strong))


def _otsu(values: Bytes) -> float:
    """Otsu's threshold of values (n,), below all of them where they are one."""
    return float(threshold_otsu(values)) if values.min() < values.max() else float(values.max()) - 1


def _own(fainter: BoolArray, stronger: BoolArray) -> BoolArray:
    """Fainter ink (rows, columns) without the seams of stronger ink; none where that is little."""
    own = fainter & ~widened(stronger)
    return own if own.sum() >= _OWN_SHARE * stronger.sum() else np.zeros_like(own)


def _is_lines(ink: BoolArray, line_px: float) -> bool:
    """Whether ink (rows, columns) is lines, no fill."""
    distance = np.asarray(cv2.distanceTransform(ink.astype(np.uint8), cv2.DIST_L2, cv2.DIST_MASK_3))
    return bool((distance[ink] > max(line_px, _LINE_PX) / 2).mean() < _FILL_SHARE)


_THICKEST_M = 0.6
"""What is thicker is not a wall but a solid area, metres."""
_BOLD = 0.7
"""Strokes of at least this share of the walls' thickness are as bold as walls."""
_FULL = 0.75
"""A column or a piece of wall fills at least this share of the rectangle around it; letters and outlines do not."""
_LEAST_CIRCLE_PX = 6.0
_LEAST_BOLD_PX = 4.0
"""Where walls are thinner, in pixels, their thickness is meaningless."""


def only_walls(ink: BoolArray, pixel_m: float, drawn_m: float, settings: WalkableSettings) -> BoolArray:
    """Leave of the ink (rows, columns) on a plan, pixels of ``pixel_m``, what no one walks through.

    ``drawn_m`` is the pixel in which the plan was drawn, larger where ``ink`` is an enlargement.
    """
    thickest_px = _THICKEST_M / pixel_m
    walls = _without_symbols(ink, usual_thickness(ink, thickest_px), SYMBOL_M / pixel_m)
    walls |= continuing_walls(walls, ink & ~walls, pixel_m)
    walls = _filled(walls, settings.passage_m / pixel_m)
    thickness = usual_thickness(walls, thickest_px)
    if thickness >= _LEAST_BOLD_PX:
        walls = _without_thin(walls, thickness * STROKE_SHARE)
    # Circles of a few pixels cannot be determined from corners.
    least_m, most_m = max(SWING_M[0], _LEAST_CIRCLE_PX * drawn_m), SWING_M[1]
    return without_swings(walls, (least_m / pixel_m, most_m / pixel_m)) if least_m < most_m else walls


def usual_thickness(walls: BoolArray, thickest_px: float) -> float:
    """Median thickness of all strokes (rows, columns) but solid areas, weighted by their length, in pixels; 0 where
    there are none.
    """
    thickness = 2 * clearance_px(walls)[skeletonize(walls)] - 1
    thickness = thickness[thickness <= thickest_px]
    return float(np.median(thickness)) if len(thickness) else 0.0


def _filled(ink: BoolArray, passage_px: float) -> BoolArray:
    """Fill what is closed off and too narrow for anybody (rows, columns): the inside of walls drawn as two lines,
    treads of stairs.
    """
    free = np.pad(~ink, 1, constant_values=True)
    labels = regions(free)
    widest = np.zeros(int(labels.max()) + 1, dtype=np.float32)
    np.maximum.at(widest, labels.ravel(), clearance_px(free).ravel())
    narrow: BoolArray = 2 * widest - 1 < passage_px
    narrow[0] = True
    filled: BoolArray = narrow[labels][1:-1, 1:-1]
    return filled


def _without_symbols(walls: BoolArray, thickness_px: float, symbol_px: float) -> BoolArray:
    """Leave out of walls (rows, columns) small ink that touches nothing else, except for columns and pieces of wall."""
    labels, boxes, sides = parts_of(walls)
    small = np.flatnonzero(sides < symbol_px).tolist()
    left_out = np.zeros(len(boxes), dtype=np.bool_)
    left_out[[part for part in small if part and not _solid(labels, boxes[part], part, thickness_px)]] = True
    kept: BoolArray = walls & ~left_out[labels]
    return kept


def _solid(labels: IntArray, box: IntArray, part: int, thickness_px: float) -> bool:
    """Whether a part of the ink, by ``labels`` (rows, columns), is a full rectangle or disc, as bold as the walls;
    ``box`` (5,) of it in pixels.
    """
    left, top, width, height, area = box.tolist()
    own = labels[top : top + height, left : left + width] == part
    bold = 2 * clearance_px(np.pad(own, 1)).max() - 1
    if bold < max(_BOLD * thickness_px, _LEAST_BOLD_PX):
        return False
    corners = np.argwhere(own)[:, ::-1].astype(np.float32)
    (_, (long, short), _) = cv2.minAreaRect(corners)
    return bool(area >= _FULL * (long + 1) * (short + 1))


def _without_thin(walls: BoolArray, thickness_px: float) -> BoolArray:
    """Leave out strokes (rows, columns) thinner than this; what is thicker keeps its ends and corners."""
    core = clearance_px(walls) >= (thickness_px + 1) / 2
    reach = clearance_px(~core)
    return walls & (reach <= thickness_px)


_LETTER_PX = (4, 14)
"""Letters that can be read have a size in this range, pixels, or are smaller than a symbol."""
_LEAST_LETTERS = 12
_ALIKE = 30
"""Colours that differ by less in each channel (of 255) are one."""
_UNLIKE = 60
"""Colours that differ by more in some channel are two."""
_AGREE = 0.6
"""This share of the letters has one colour ..."""
_OTHERS = 0.35
"""... that at most this share of all other ink has, too."""
_STROKE_PX = 5
"""Walls go on below strokes of up to twice this."""
_DIRECTIONS = 12


def lettering(image: Bytes, ink: Bytes, walls: BoolArray, symbol_px: float) -> BoolArray:
    """Return which pixels of an image (rows, columns, 3) are text, where walls have another colour.

    ``ink`` and ``walls`` (rows, columns) are the image's own. Ink that touches nothing else and is as large as letters
    has the text's colour; without enough of it, or where walls have that colour, nothing is text.
    """
    letters = _letters(walls, max(symbol_px, _LETTER_PX[1]))
    colour = _colour_of(image, ink, letters)
    if colour is None:
        return np.zeros_like(walls)
    alike = (np.abs(image.astype(np.int16) - colour) <= _ALIKE).all(axis=2)
    # Darker lines have seams of any grey, the text's as well.
    seams = widened(ink > ink[alike & walls].max(initial=0))
    alike &= walls & ~seams
    others = walls & (letters == 0)
    unlike = others & ~alike
    if (alike & others).sum() > _OTHERS * others.sum() or not _differ(colour, image[unlike], ink[unlike]):
        return np.zeros_like(walls)
    text = walls & widened(alike) & ~seams
    return text & ~_going_on_below(walls & ~text, _STROKE_PX)


def _letters(walls: BoolArray, largest_px: float) -> Bytes:
    """Which ink (rows, columns) may be letters, by number of the letter; 0 elsewhere."""
    labels, _, sides = parts_of(walls)
    letter = (sides >= _LETTER_PX[0]) & (sides <= largest_px)
    numbers = np.cumsum(letter) * letter
    numbers[0] = 0
    return np.asarray(numbers[labels])


def _colour_of(image: Bytes, ink: Bytes, letters: Bytes) -> Bytes | None:
    """The colour (3,) that letters have where they are darkest; None where they are few or of many colours."""
    row, column = np.nonzero(letters)
    order = np.lexsort((-ink[row, column].astype(np.int16), letters[row, column]))
    row, column = row[order], column[order]
    _, darkest = np.unique(letters[row, column], return_index=True)
    if len(darkest) < _LEAST_LETTERS:
        return None
    colours = image[row[darkest], column[darkest]].astype(np.int16)
    usual = np.median(colours, axis=0).astype(np.int16)
    agree = (np.abs(colours - usual) <= _ALIKE).all(axis=1).mean() >= _AGREE
    return np.asarray(usual) if agree else None


def _differ(text: Bytes, walls: Bytes, ink: Bytes) -> bool:
    """Whether text has another colour (3,) than walls (n, 3), seams left out; compression blurs both."""
    core = walls[ink >= np.median(ink)] if len(ink) else walls
    return len(core) > 0 and bool((np.abs(np.median(core, axis=0) - text) > _UNLIKE).any())


def _going_on_below(walls: BoolArray, reach_px: int) -> BoolArray:
    """The walls (rows, columns) with their gaps of up to twice ``reach_px`` closed, along lines of many directions."""
    closed = walls.astype(np.uint8)
    centre = np.array((reach_px, reach_px))
    for angle in np.arange(_DIRECTIONS) * np.pi / _DIRECTIONS:
        reach = np.round(reach_px * np.array((np.cos(angle), np.sin(angle)))).astype(int)
        line = np.zeros((2 * reach_px + 1,) * 2, dtype=np.uint8)
        cv2.line(line, (centre - reach).tolist(), (centre + reach).tolist(), 1)
        closed |= np.asarray(cv2.morphologyEx(walls.astype(np.uint8), cv2.MORPH_CLOSE, line))
    return closed > 0


_BELOW_PX = 5.0
"""What is below text is guessed from so many pixels around."""
_MORE = 1.2
"""Hatching is looked for in an image of at most so many times the pixels before its lines are widened."""
_DIAGONAL = 0.4
"""Pixels that touch at a corner stay joined where an enlarged image has more than this."""


def image_walls(plan: FloorPlan, grid: CellGrid, settings: WalkableSettings) -> BoolArray:
    """Return which cells (rows, columns) the plan's image shows as walls; raises SurveyError where it shows none."""
    left, right, low, high = plan.extent_m
    width, height = right - left, high - low
    finest = float(np.sqrt(width * height / settings.max_pixels))
    pixel_m = min(max(finest, *plan.pixel_m), grid.cell_m)
    shape = max(1, round(height / pixel_m)), max(1, round(width / pixel_m))
    walls = only_walls(_drawn(plan, shape, settings), pixel_m, max(plan.pixel_m), settings)
    share = cv2.resize(walls.astype(np.float32), grid.shape[::-1], interpolation=cv2.INTER_AREA)
    cells = np.asarray(share >= 0.5)
    # Walls thinner than a cell are kept, and none has a gap that is not drawn.
    row, column = np.nonzero(skeletonize(walls))
    cells[row * grid.rows // shape[0], column * grid.columns // shape[1]] = True
    return cells


def without_hatching(ink: Bytes, drawn: BoolArray, pixel_m: float) -> Bytes:
    """Leave out of ink (rows, columns), pixels of ``pixel_m``, the hatching of areas; walls that it crosses stay.

    ``drawn`` (rows, columns) is what stands out.
    """
    strokes = hatching(drawn, pixel_m)
    if not strokes.any():
        return ink
    bold = round(usual_thickness(strokes, _THICKEST_M / pixel_m)) + 2
    thick = cv2.morphologyEx(drawn.astype(np.uint8), cv2.MORPH_OPEN, np.ones((bold, bold), dtype=np.uint8)) > 0
    walls = _going_on_below(drawn & ~strokes, _STROKE_PX) | thick
    return np.where(widened(strokes) & ~walls, 0, ink).astype(np.uint8)


def without_coloured_lines(ink: Bytes, lines: BoolArray) -> Bytes:
    """Leave coloured lines (rows, columns) out of ink; walls that they cross stay."""
    if not lines.any():
        return ink
    seams = widened(lines) & (ink < np.median(ink[lines]))
    others = (ink > FAINTEST) & ~lines & ~seams
    reach = int(np.ceil(usual_thickness(lines, _LINE_PX * _STROKE_PX) / 2)) + 1
    left = np.where(lines | seams, 0, ink).astype(np.uint8)
    left[lines & _going_on_below(others, reach)] = np.median(ink[others])
    return left


def wall_colours(plan: FloorPlan) -> tuple[ColouredLines, bool]:
    """Lines of other colours than the walls on a plan's image, and whether they join the walls."""
    pixel_m = max(plan.pixel_m)
    ink, lines = _coloured(plan.image, pixel_m)
    return lines, lines.join(ink > FAINTEST, SYMBOL_M / pixel_m)


def _coloured(image: Bytes, pixel_m: float) -> tuple[Bytes, ColouredLines]:
    """An image's ink (rows, columns) without coloured areas, and lines in it of other colours than the walls."""
    ink = without_areas(image, ink_on_paper(image), _AREA_M / pixel_m)
    return ink, coloured_lines(image, _paper_colour(image), ink > FAINTEST, SYMBOL_M / pixel_m)


def thickness_drawn_px(plan: FloorPlan) -> float:
    """Mean thickness of long lines on a plan's image, pixels: seams count by how dark they are."""
    ink, pixel_m = ink_on_paper(plan.image), max(plan.pixel_m)
    walls = walls_in(ink, None, WalkableSettings().passage_m / pixel_m)
    labels, _, sides = parts_of(walls)
    long = walls & (sides >= SYMBOL_M / pixel_m)[labels]
    darkest = np.percentile(ink[walls], 99)
    return float(ink[widened(long)].sum() / darkest / max(skeletonize(long).sum(), 1))


def _drawn(plan: FloorPlan, shape: tuple[int, int], settings: WalkableSettings) -> BoolArray:
    """What stands out on the plan's image, without text of its own colour, as ``shape`` (rows, columns) pixels."""
    image: Bytes = plan.image[::-1]
    pixels = shape[0] * shape[1]
    if settings.wall_contrast is None:
        ink, lines = _coloured(image, max(plan.pixel_m))
        ink = without_coloured_lines(ink, lines.left_out)
    else:
        ink = ink_on_paper(image)
    large = ink.size > pixels
    if ink.size > _MORE * pixels:
        ink = reduced(ink, shape)
    pixel_m = max(plan.pixel_m) * plan.image.shape[0] / ink.shape[0]
    line_px = settings.passage_m / pixel_m
    ink = without_hatching(ink, walls_in(ink, settings.wall_contrast, line_px), pixel_m)
    if large:
        return walls_in(reduced(ink, shape), settings.wall_contrast, line_px)
    text = lettering(image, ink, walls_in(ink, None, line_px), SYMBOL_M / pixel_m)
    below = np.asarray(cv2.inpaint(ink, text.astype(np.uint8), _BELOW_PX, cv2.INPAINT_NS), dtype=np.uint8)
    drawn = walls_in(below, settings.wall_contrast, line_px)
    return np.asarray(cv2.resize(drawn.astype(np.float32), shape[::-1], interpolation=cv2.INTER_LINEAR) > _DIAGONAL)
