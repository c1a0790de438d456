"""How well printed landmarks are recognised among 500 of them, and never taken for another.

Usage: python benchmarks/sheet_recognition.py [--ids 500] [--views 50] [--detectors orb sift]
           [--voters 400] [--csv FILE]

The sheets are made as `vislam2tag sheets --ids 1-500` makes them; pages of its PDF are rendered and looked at through a
simulated camera, with all that is printed beside the image and clutter on the wall behind. Each frame is searched for
all images of the set; a landmark of another seed, which is not in the set, must not be found.
"""

from __future__ import annotations

import argparse
import csv
import tempfile
from collections.abc import Callable, Iterator
from dataclasses import asdict, dataclass
from pathlib import Path

import cv2
import numpy as np
import pypdfium2
from PIL import Image

from vislam2tag.sheets.dead_leaves import dead_leaves_picture
from vislam2tag.sheets.features import Features, GreyImage, features_of, orb, reference
from vislam2tag.sheets.making import SheetOptions, make_sheets
from vislam2tag.sheets.page_layout import page_layout
from vislam2tag.sheets.quality import HARD_VIEW
from vislam2tag.sheets.recognition import ENOUGH_INLIERS, FEATURES, FRAME_FEATURES, Recogniser
from vislam2tag.sheets.sheet_folder import PDF_FILE, SheetsRecord
from vislam2tag.sheets.views import FRAME_PX, Rectangle, View, bordered, camera_frame
from vislam2tag.survey.sheet_size import SHEET_SIZES

CONDITIONS = {
    "fills 25 % of the view, faced": View(),
    "20 %": View(share=0.2),
    "12 %": View(share=0.12),
    "6 %": View(share=0.06),
    "phone rolled by 40°": View(roll_deg=40),
    "turned away sideways by 40°": View(yaw_deg=40),
    "turned away upwards by 40°": View(pitch_deg=40),
    "20 %, turned away by 40°": View(share=0.2, yaw_deg=40),
    "blurred, 2 px": View(blur_px=2),
    "blurred, 3 px": View(blur_px=3),
    "dim, 1/3 of the light": View(light=0.33, noise=6),
    "dark, 1/7 of the light": View(light=0.15, noise=6),
    "all at once": HARD_VIEW,
}
STRANGE = "not in the set, 25 %, faced"
DETECTORS: dict[str, Callable[[int], cv2.Feature2D]] = {"orb": orb, "sift": lambda count: cv2.SIFT.create(count)}


@dataclass(frozen=True)
class Row:
    """One detector under one condition; corners in pixels of the frame."""

    detector: str
    condition: str
    views: int
    recognised: int
    wrong: int
    median_inliers: float
    least_inliers: int
    median_corner_px: float
    p95_corner_px: float


def main() -> None:
    """Make the set, look at it, print the table."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--ids", type=int, default=500)
    parser.add_argument("--views", type=int, default=50)
    parser.add_argument("--detectors", nargs="+", choices=list(DETECTORS), default=list(DETECTORS))
    parser.add_argument("--voters", type=int, default=FEATURES, help="features of each image that find candidates")
    parser.add_argument("--csv", type=Path)
    options = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        made = make_sheets(SheetOptions(ids=f"1-{options.ids}"), Path(folder) / "sheets")
        print(about(made), flush=True)
        looked = np.linspace(0, options.ids - 1, min(options.views, options.ids)).astype(int).tolist()
        pages = {index: page(Path(folder) / "sheets" / PDF_FILE, index) for index in looked}
    images = [dead_leaves_picture(0, one.landmark, one.attempt) for one in made.images]
    rows = []
    for name in options.detectors:
        for row in measured(name, images, pages, options.voters):
            rows.append(row)
            print(line(row), flush=True)
    if options.csv:
        with options.csv.open("w", newline="") as file:
            writer = csv.DictWriter(file, list(asdict(rows[0])), lineterminator="\n")
            writer.writeheader()
            writer.writerows(map(asdict, rows))


def about(made: SheetsRecord) -> str:
    """What was measured of the set itself."""
    quality = [one.quality for one in made.images]
    return (
        f"{len(made.images)} images, {sum(one.attempt > 0 for one in made.images)} generated anew; least of all: "
        f"contrast {min(one.contrast for one in quality):.0f}, features {min(one.features for one in quality)}, "
        f"spread {100 * min(one.spread for one in quality):.0f} %, inliers of a hard view "
        f"{min(one.inliers for one in quality)}; most of all: "
        f"repeats {100 * max(one.repeats for one in quality):.0f} %, "
        f"inliers of another image {max(one.most_like_inliers for one in made.images)} ({ENOUGH_INLIERS} would count)"
    )


def page(pdf: Path, index: int) -> tuple[GreyImage, Rectangle]:
    """Render a page at the images' own resolution; return it and where on it the image stands."""
    box = page_layout(SHEET_SIZES["A4"], SHEET_SIZES["A4"].image_m, 1.0, "").image
    pixels_a_metre = 640 / box.width_m
    document = pypdfium2.PdfDocument(pdf)
    shown = document[index].render(scale=pixels_a_metre * 0.0254 / 72).to_pil().convert("L")
    document.close()
    paper = SHEET_SIZES["A4"]
    top = paper.height_m - box.low_m - box.height_m
    corner = (round(box.left_m * pixels_a_metre), round(top * pixels_a_metre))
    return np.array(shown, np.uint8), (*corner, 640, 640)


def measured(
    name: str, images: list[GreyImage], pages: dict[int, tuple[GreyImage, Rectangle]], voters: int
) -> Iterator[Row]:
    """Search the views of the pages for all images with one detector."""
    make = DETECTORS[name]
    keeper, finder = make(FEATURES), make(FRAME_FEATURES)
    recogniser = Recogniser([features_of(reference(image), keeper) for image in images], voters)
    wall = clutter()
    for condition, view in CONDITIONS.items():
        yield looked_at(name, condition, recogniser, {i: (*pages[i], view) for i in pages}, finder, wall)
    strange = {-2 - i: (*bordered(dead_leaves_picture(1, str(i))), View()) for i in range(len(pages))}
    yield looked_at(name, STRANGE, recogniser, strange, finder, wall)


def looked_at(
    name: str,
    condition: str,
    recogniser: Recogniser,
    sheets: dict[int, tuple[GreyImage, Rectangle, View]],
    finder: cv2.Feature2D,
    wall: GreyImage,
) -> Row:
    """Count what is recognised of sheets given by the index that they must be found as; none has a negative one."""
    inliers, wrong, errors = [], 0, []
    for index, (paper, image, view) in sheets.items():
        frame = camera_frame(paper, image, view, wall, seed=abs(index))
        features: Features = features_of(frame.image, finder)
        found = recogniser.best(features)
        right = found.index == index
        inliers.append(found.inliers if right or index < 0 else 0)
        wrong += found.inliers >= ENOUGH_INLIERS and not right
        if right and found.inliers >= ENOUGH_INLIERS:
            errors.append(float(np.linalg.norm(found.corners - frame.corners, axis=1).max()))
    middle, high = np.percentile(errors, (50, 95)) if errors else (np.nan, np.nan)
    return Row(
        detector=name,
        condition=condition,
        views=len(sheets),
        recognised=len(errors),
        wrong=wrong,
        median_inliers=float(np.median(inliers)),
        least_inliers=min(inliers),
        median_corner_px=float(middle),
        p95_corner_px=float(high),
    )


def clutter() -> GreyImage:
    """A wall with large soft shapes behind the sheets, and some sharp ones."""
    soft = cv2.resize(cv2.GaussianBlur(dead_leaves_picture(9, "wall"), (0, 0), 6), FRAME_PX)
    wall = np.array(soft // 2 + 100, np.uint8)
    wall[:, :90] = np.array(Image.fromarray(dead_leaves_picture(9, "poster")).resize((90, FRAME_PX[1])), np.uint8)
    return wall


def line(row: Row) -> str:
    """One line of the table in docs/results/sheets.md."""
    corner = "-" if np.isnan(row.median_corner_px) else f"{row.median_corner_px:.1f} / {row.p95_corner_px:.1f}"
    return (
        f"| {row.detector.upper()} | {row.condition} | {row.recognised} of {row.views} | {row.wrong} | "
        f"{row.median_inliers:.0f} / {row.least_inliers} | {corner} |"
    )


if __name__ == "__main__":
    main()
