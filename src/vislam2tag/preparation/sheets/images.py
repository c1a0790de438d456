"""The images of landmarks: generated ones, and folders of users' own, each with what was measured of it."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from vislam2tag.common.errors import SurveyError, UsageError
from vislam2tag.common.progress import Progress, silent
from vislam2tag.preparation.sheets.dead_leaves import dead_leaves_picture
from vislam2tag.preparation.sheets.features import Features, GreyImage
from vislam2tag.preparation.sheets.quality import ImageQuality, quality_of, reference_features
from vislam2tag.preparation.sheets.recognition import ENOUGH_INLIERS, VOTERS, Recogniser
from vislam2tag.site.names import landmark_id
from vislam2tag.site.plans.images import load_plan, on_paper

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


@dataclass(frozen=True)
class Lookalike:
    """The other image of a set that one could most easily be taken for."""

    landmark: str
    other: str
    inliers: int
    """Features that agree, by chance; from 20 on the two would be confused."""


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
    raise UsageError(f"--seed {seed}: none of {_ATTEMPTS} pictures of landmark {landmark} is fit; choose another seed")


def own_files(folder: Path) -> dict[str, Path]:
    """List a folder's images by landmark: the file's name without ending is the id.

    Raises SurveyError where there is no such folder or no image, or where a name is no id or two are one.
    """
    try:
        paths = sorted(path for path in folder.iterdir() if path.suffix.lower() in IMAGE_ENDINGS)
    except OSError as error:
        raise SurveyError(f"{folder}: cannot be listed ({error.strerror}); expected a folder of images") from error
    files: dict[str, Path] = {}
    for path in paths:
        name = landmark_id(path.stem)
        if not name:
            raise SurveyError(f"{path}: '{path.stem}' cannot be an id; rename the file")
        if name in files:
            raise SurveyError(f"{folder}: {files[name].name} and {path.name} are one id, {name}; rename one")
        files[name] = path
    if not files:
        raise SurveyError(f"{folder}: holds no image ({', '.join(IMAGE_ENDINGS)})")
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
        count = f"{len(faulty)} of {len(found)} images cannot be landmarks"
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


def lookalikes(images: Sequence[LandmarkImage], progress: Progress[str] = silent) -> Iterable[Lookalike]:
    """Yield for each image of a set the other that it could most easily be taken for."""
    recogniser = Recogniser([image.features for image in images], VOTERS)
    for index, image in enumerate(images):
        nearest = recogniser.most_like(index)
        progress(image.landmark, len(images))
        yield Lookalike(image.landmark, images[nearest.index].landmark if nearest.index >= 0 else "", nearest.inliers)


def confused(likeness: Sequence[Lookalike]) -> tuple[str, ...]:
    """Name the pairs that would be taken for each other, ``3 and 9``, each once."""
    pairs = {tuple(sorted((one.landmark, one.other))) for one in likeness if one.inliers >= ENOUGH_INLIERS}
    return tuple(f"{first} and {second}" for first, second in sorted(pairs))
