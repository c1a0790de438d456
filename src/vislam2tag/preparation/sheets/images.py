"""The images of landmarks: generated ones and users' own, each with what was measured of it.

Generated images are opaque leaves of random shape, size and tone that fall on each other. The dead-leaves model (Lee,
Mumford, Huang: Occlusion models for natural images, IJCV 2001) has the statistics of photographs. It has corners at
every scale, so that it is recognised from near and far, and no line or grid that repeats. It is made of random numbers
alone, so no one has rights in it.
"""

from __future__ import annotations

import hashlib
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import cv2
import numpy as np
import numpy.typing as npt

from vislam2tag.common.errors import SurveyError, UsageError
from vislam2tag.common.progress import Progress, silent
from vislam2tag.common.records import Record
from vislam2tag.core.arrays import FloatArray
from vislam2tag.preparation.sheets.features import (
    ENOUGH_INLIERS,
    FEATURES,
    FRAME_FEATURES,
    FRAME_PX,
    VOTERS,
    Features,
    GreyImage,
    Recogniser,
    View,
    bordered,
    camera_frame,
    features_of,
    orb,
    reference,
    sighting,
)
from vislam2tag.site.model import landmark_id
from vislam2tag.site.plans.images import load_plan, on_paper

SIDE_PX = 640
"""Side of a picture: 3.4 px a millimetre on A4. ARCore gains nothing beyond 300 px, the print does."""
_TONES = 16
"""Grey levels kept: half the bytes of 256, and what blurs, dims and prints is the same."""
_LEAVES = 700
_SMALLEST, _LARGEST = 1 / 45, 1 / 6
"""Mean radius of a leaf, sides of the picture: the smallest are seen where the sheet fills a fifth of the view."""
_SIZE_POWER = 3.0
"""Density of radii r is r^-3, as in the model: each scale covers the same area."""
_CORNERS = 7
_ROUGHNESS = 0.45
"""How much the radius of a corner differs from the leaf's, at most."""
_SUBPIXEL_BITS = 4
_NUMBERS = 4 + 2 * _CORNERS


def dead_leaves_picture(seed: int, landmark: str, attempt: int = 0) -> GreyImage:
    """Draw the grey picture (SIDE_PX, SIDE_PX) of a landmark: the same for the same seed, id and attempt.

    Leaves fall in the order of their size, the largest first, so that no large one buries the rest of its area.
    """
    chance = _uniform(seed, landmark, attempt)
    radius = np.sort(_radii(chance[:, 0]))[::-1]
    corners = _corners(radius, chance)
    image = np.full((SIDE_PX, SIDE_PX), 128, np.uint8)
    for outline, tone in zip(corners, (255 * chance[:, 1]).astype(int).tolist(), strict=True):
        cv2.fillPoly(image, [outline], tone, cv2.LINE_AA, _SUBPIXEL_BITS)
    step = 256 // _TONES
    return image // np.uint8(step) * np.uint8(255 // (_TONES - 1))


def _uniform(seed: int, landmark: str, attempt: int) -> FloatArray:
    """Random numbers (leaves, ...) in [0, 1) that follow from seed, id and attempt alone."""
    digest = hashlib.sha256(f"{seed}\0{attempt}\0{landmark}".encode("utf-8", "surrogateescape")).digest()
    return np.random.Generator(np.random.PCG64(int.from_bytes(digest, "big"))).random((_LEAVES, _NUMBERS))


def _radii(chance: FloatArray) -> FloatArray:
    """Radii (n,) in pixels, by the inverse of their distribution."""
    power = 1 - _SIZE_POWER
    small, large = _SMALLEST**power, _LARGEST**power
    radii: FloatArray = SIDE_PX * (small + chance * (large - small)) ** (1 / power)
    return radii


def _corners(radius: FloatArray, chance: FloatArray) -> npt.NDArray[np.int32]:
    """Corners (n, c, 2) of the leaves, in sixteenths of a pixel; centres reach beyond the picture's edge."""
    centre = SIDE_PX * (1.2 * chance[:, 2:4] - 0.1)
    turn, length = chance[:, 4 : 4 + _CORNERS], chance[:, 4 + _CORNERS :]
    angle = 2 * np.pi * (np.arange(_CORNERS) + 0.9 * turn) / _CORNERS
    reach = radius[:, None] * (1 + _ROUGHNESS * (2 * length - 1))
    arms = reach[..., None] * np.stack((np.cos(angle), np.sin(angle)), axis=-1)
    corners: npt.NDArray[np.int32] = np.rint((centre[:, None] + arms) * 2**_SUBPIXEL_BITS).astype(np.int32)
    return corners


IMAGE_ENDINGS = (".png", ".jpg", ".jpeg")
"""What ARCore takes."""
_GREATEST_SIDE_PX = 2000
"""Own images are shrunk to this: finer detail is lost in print and only swells the PDF."""
_ATTEMPTS = 20
_NAMED = 10
"""Faulty images that a message names."""


@dataclass(frozen=True)
class LandmarkImage:
    """A landmark's image, fit to be one."""

    landmark: str
    pixels: GreyImage
    features: Features
    quality: ImageQuality
    attempt: int = 0
    """Pictures of this id that were generated before and were not fit."""


Likeness = tuple[str, int]
"""The other image of a set that one could most easily be taken for (empty: none), and how many features agree by
chance; from 20 on the two would be confused."""


def generated_image(
    seed: int, landmark: str, draw: Callable[[int, str, int], GreyImage] = dead_leaves_picture
) -> LandmarkImage:
    """Generate the image (height, width) of a landmark: the first picture that is fit, whatever other ids there are."""
    for attempt in range(_ATTEMPTS):
        pixels = draw(seed, landmark, attempt)
        features = reference_features(pixels)
        quality = quality_of(pixels, features)
        if not quality.faults:
            return LandmarkImage(landmark, pixels, features, quality, attempt)
    raise UsageError(
        f"--seed {seed}: none of {_ATTEMPTS} pictures of landmark {landmark} is suitable; choose another seed"
    )


def own_files(folder: Path) -> dict[str, Path]:
    """List a folder's images by landmark: the file's name without ending is the id.

    Raises SurveyError where there is no such folder or no image, or where a name is not an id or two are one.
    """
    try:
        paths = sorted(path for path in folder.iterdir() if path.suffix.lower() in IMAGE_ENDINGS)
    except OSError as error:
        raise SurveyError(f"{folder}: cannot be listed ({error.strerror}); expected a folder of images") from error
    files: dict[str, Path] = {}
    for path in paths:
        name = landmark_id(path.stem)
        if not name:
            raise SurveyError(f"{path}: '{path.stem}' is not a valid id; rename the file")
        if name in files:
            raise SurveyError(f"{folder}: {files[name].name} and {path.name} have the same id, {name}; rename one")
        files[name] = path
    if not files:
        raise SurveyError(f"{folder}: contains no image ({', '.join(IMAGE_ENDINGS)})")
    return files


def own_images(folder: Path, files: Mapping[str, Path], progress: Progress[str] = silent) -> tuple[LandmarkImage, ...]:
    """Read the images of landmarks; raises SurveyError naming all that cannot be read or cannot be a landmark."""
    found: list[LandmarkImage] = []
    faulty: list[str] = []
    for landmark, path in files.items():
        pixels = read_grey(path)
        features = reference_features(pixels)
        quality = quality_of(pixels, features)
        found.append(LandmarkImage(landmark, pixels, features, quality))
        if quality.faults:
            faulty.append(f"{path.name} ({'; '.join(quality.faults)})")
        progress(landmark, len(files))
    if faulty:
        count = f"{len(faulty)} of {len(found)} images are not suitable as landmarks"
        more = ", ..." if len(faulty) > _NAMED else ""
        raise SurveyError(f"{folder}: {count}: {', '.join(faulty[:_NAMED])}{more}; replace them")
    return tuple(found)


def read_grey(path: Path) -> GreyImage:
    """The grey levels (height, width) of an image file; raises SurveyError where it is none."""
    try:
        image = load_plan(path, _GREATEST_SIDE_PX)
    except OSError as error:
        raise SurveyError(f"{path}: {error}; replace it") from error
    return np.array(on_paper(image, _GREATEST_SIDE_PX).convert("L"), np.uint8)


def lookalikes(images: Sequence[LandmarkImage], progress: Progress[str] = silent) -> Iterable[Likeness]:
    """Yield for each image of a set the other that it could most easily be taken for."""
    recogniser = Recogniser([image.features for image in images], VOTERS)
    for index, image in enumerate(images):
        nearest = recogniser.most_like(index)
        progress(image.landmark, len(images))
        yield images[nearest.index].landmark if nearest.index >= 0 else "", nearest.inliers


def confused(landmarks: Sequence[str], likeness: Sequence[Likeness]) -> tuple[str, ...]:
    """Name the pairs that would be taken for each other, ``3 and 9``, each once."""
    found = zip(landmarks, likeness, strict=True)
    pairs = {tuple(sorted((one, other))) for one, (other, inliers) in found if inliers >= ENOUGH_INLIERS}
    return tuple(f"{first} and {second}" for first, second in sorted(pairs))


LEAST_SIDE_PX = 300
"""ARCore's own least size of a reference image."""
LEAST_CONTRAST = 30.0
"""Standard deviation of the grey levels (0 to 255)."""
LEAST_FEATURES = 500
LEAST_SPREAD = 0.75
MOST_REPEATS = 0.25
HARD_VIEW = View(share=0.2, roll_deg=15, yaw_deg=40, blur_px=1.5, light=0.3, noise=6)
"""A sheet filling a fifth of the view, turned away by 40 degrees, blurred, in dim light."""
_COUNTED = 2000
"""Features that are looked for where they are counted."""
_CELLS = 6
"""The image is looked at in as many columns and rows."""
_OF_A_CELL = 3
"""Features that a cell needs to count as covered."""
_TWIN_BITS = 40
"""Features that differ in at most so many of 256 bits look the same."""
_APART = 0.08
"""Sides of the image between two features that count as a repeat; closer ones are one corner found twice."""


class ImageQuality(Record):
    """What was measured of one image."""

    shorter_side_px: int
    contrast: float
    """Standard deviation of the grey levels."""
    features: int
    """Features found at the size of reference, at most 2000."""
    spread: float
    """Share of 36 cells of the image that contain features."""
    repeats: float
    """Share of the features that look like another one elsewhere in the image."""
    holds_code: bool
    """It contains a QR code or barcode."""
    inliers: int
    """Features that agree where the sheet is seen as in :data:`HARD_VIEW`."""

    @property
    def faults(self) -> tuple[str, ...]:
        """Why the image is not a landmark, each with its figure and what is needed; empty where it is one."""
        checks = (
            (
                self.shorter_side_px < LEAST_SIDE_PX,
                f"its shorter side has {self.shorter_side_px} px, but needs {LEAST_SIDE_PX}",
            ),
            (
                self.contrast < LEAST_CONTRAST,
                f"its contrast is {self.contrast:.0f}, but must be at least {LEAST_CONTRAST:.0f}",
            ),
            (self.features < LEAST_FEATURES, f"it has {self.features} features, but needs {LEAST_FEATURES}"),
            (
                self.spread < LEAST_SPREAD,
                f"it has features in {100 * self.spread:.0f} % of its area, but needs {100 * LEAST_SPREAD:.0f} %",
            ),
            (
                self.repeats > MOST_REPEATS,
                f"{100 * self.repeats:.0f} % of its features repeat, but at most {100 * MOST_REPEATS:.0f} % may",
            ),
            (self.holds_code, "it contains a QR code or barcode, which trackers follow badly"),
            (
                self.inliers < ENOUGH_INLIERS,
                f"seen from 40 degrees, blurred and in dim light, {self.inliers} features match, but {ENOUGH_INLIERS} "
                "are needed",
            ),
        )
        return tuple(fault for present, fault in checks if present)


def reference_features(image: GreyImage) -> Features:
    """Take the features that a recogniser keeps of an image (height, width)."""
    return features_of(reference(image), orb(FEATURES))


def quality_of(image: GreyImage, features: Features) -> ImageQuality:
    """Measure an image (height, width) whose :func:`reference_features` are known."""
    wall = np.full((FRAME_PX[1], FRAME_PX[0]), 180, np.uint8)
    frame, _ = camera_frame(*bordered(image), HARD_VIEW, wall)
    every = features_of(reference(image), orb(_COUNTED))
    return ImageQuality(
        shorter_side_px=min(image.shape),
        contrast=round(float(image.std()), 1),
        features=len(every),
        spread=round(_spread(every), 3),
        repeats=round(_repeats(features), 3),
        holds_code=_holds_code(reference(image)),
        inliers=sighting(features_of(frame, orb(FRAME_FEATURES)), features).inliers,
    )


def _spread(features: Features) -> float:
    """Share of the image's cells that contain enough features."""
    cells: FloatArray = np.floor(features.points / features.size_px * _CELLS)
    index = (cells[:, 0] * _CELLS + cells[:, 1]).astype(np.int64)
    return float(np.mean(np.bincount(index, minlength=_CELLS**2) >= _OF_A_CELL))


def _repeats(features: Features) -> float:
    """Share of the features that have a twin elsewhere in the image."""
    if not len(features):
        return 0.0
    bits = np.unpackbits(features.descriptors, axis=1).astype(np.float32)
    ones = bits.sum(axis=1)
    differing = ones[:, None] + ones - 2 * bits @ bits.T
    apart = np.linalg.norm(features.points[:, None] - features.points, axis=2) > _APART * min(features.size_px)
    return float(np.mean(np.any((differing <= _TWIN_BITS) & apart, axis=1)))


def _holds_code(image: GreyImage) -> bool:
    """Whether OpenCV reads a QR code or a barcode in an image (height, width)."""
    if cv2.QRCodeDetector().detectAndDecode(image)[0]:
        return True
    return bool(cv2.barcode.BarcodeDetector().detectAndDecode(image)[0])
