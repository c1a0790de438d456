"""Landmarks in a picture: a printed sheet of ours, or a square tag of a known family; pictures of a session in grey."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Protocol, TypeAlias

import cv2
import numpy as np

from vislam2tag.common.errors import SessionError, UsageError
from vislam2tag.common.files.plain_files import plain, read_bytes
from vislam2tag.core.arrays import AnyArray, BoolArray, FloatArray, IntArray
from vislam2tag.preparation.sheets.features import (
    ENOUGH_INLIERS,
    FRAME_FEATURES,
    GreyImage,
    Recogniser,
    features_of,
    orb,
    resized,
)
from vislam2tag.preparation.sheets.images import own_files, read_grey, reference_features
from vislam2tag.preparation.sheets.page import TAG_FAMILY, SheetTag
from vislam2tag.preparation.sheets.sheet_folder import image_widths
from vislam2tag.sessions.apps.pictures import Pictures
from vislam2tag.site.names import landmark_id

TAG_FAMILIES = {
    "apriltag-16h5": cv2.aruco.DICT_APRILTAG_16H5,
    "apriltag-25h9": cv2.aruco.DICT_APRILTAG_25H9,
    "apriltag-36h11": cv2.aruco.DICT_APRILTAG_36H11,
    "aruco-4x4": cv2.aruco.DICT_4X4_1000,
    "aruco-5x5": cv2.aruco.DICT_5X5_1000,
    "aruco-6x6": cv2.aruco.DICT_6X6_1000,
}
"""Families of tags by the name that options have for them; the number of a tag is the id of its landmark."""
LOOK_PX = 960
"""Shorter side of the picture in which sheets are looked for; phones take 480, which places corners half as well."""
LOOK_FEATURES = 3 * FRAME_FEATURES
"""Features taken of such a picture."""
TAG_CORNER_PX = 0.5
"""Usual error of a tag's corner per axis, pixels, that was refined on the edges of its black square."""
QR_CORNER_PX = 1.0
"""Usual error of a QR code's corner per axis, pixels: they follow from its finder patterns."""
SHEET_CORNER_PX = 1.5
"""Usual error of a sheet's corner per axis, pixels: it follows from features within the image."""


OWN_REACH = 1.2
"""Features within a sheet so much larger than the one found are that one's: its edges are known to some pixels."""


@dataclass(frozen=True)
class Seen:
    """A landmark in a picture: ``corners_px`` (4, 2) from its upper left corner, clockwise as one looks at it, each
    with an error of ``sigma_px`` per axis; ``size_m`` its true width and height.
    """

    landmark: str
    corners_px: FloatArray
    sigma_px: float
    size_m: tuple[float, float]
    centre_m: tuple[float, float] = (0.0, 0.0)
    """Middle of the corners from that of the landmark, to the right and up as one looks at it."""


class Detector(Protocol):
    """Finds landmarks in a picture."""

    def find(self, picture: GreyImage) -> Sequence[Seen]:
        """List the landmarks in a picture (height, width)."""
        ...


class TagDetector:
    """Finds the tags of one family, whose black squares are ``side_m`` wide."""

    def __init__(self, family: str, side_m: float) -> None:
        parameters = cv2.aruco.DetectorParameters()
        parameters.cornerRefinementMethod = cv2.aruco.CORNER_REFINE_SUBPIX
        dictionary = cv2.aruco.getPredefinedDictionary(TAG_FAMILIES[family])
        self._detector = cv2.aruco.ArucoDetector(dictionary, parameters)
        self._side_m = side_m

    def find(self, picture: GreyImage) -> Sequence[Seen]:
        """List the tags in a picture."""
        corners, numbers, _ = self._detector.detectMarkers(picture)
        size = (self._side_m, self._side_m)
        found = zip(np.ravel(numbers if corners else ()).tolist(), corners, strict=True)  # no corners: numbers is None
        return [Seen(str(number), np.asarray(four[0], np.float64), TAG_CORNER_PX, size) for number, four in found]


class SheetTagDetector(TagDetector):
    """Finds the AprilTags that ``sheets`` printed beside pictures, by the file that it wrote beside the images."""

    def __init__(self, tags: Mapping[str, SheetTag]) -> None:
        super().__init__(TAG_FAMILY, 1.0)
        self._tags = {tag.number: (landmark, tag) for landmark, tag in tags.items()}

    def find(self, picture: GreyImage) -> Sequence[Seen]:
        """List the sheets whose tags are in a picture."""
        seen = []
        for found in super().find(picture):
            landmark, tag = self._tags.get(int(found.landmark), (None, None))
            if landmark is not None and tag is not None:
                size, centre = (tag.side_m, tag.side_m), (tag.right_m, tag.up_m)
                seen.append(Seen(landmark, found.corners_px, found.sigma_px, size, centre))
        return seen


class QrDetector:
    """Finds QR codes of a known side whose text, or what follows its last slash, is the id of a landmark."""

    def __init__(self, side_m: float) -> None:
        self._detector = cv2.QRCodeDetector()
        self._side_m = side_m

    def find(self, picture: GreyImage) -> Sequence[Seen]:
        """List the codes in a picture that can be read."""
        try:
            _, texts, corners, _ = self._detector.detectAndDecodeMulti(picture)
        except cv2.error:  # of some pictures without a code
            return []
        size = (self._side_m, self._side_m)
        return [
            Seen(landmark_id(text.rpartition("/")[2]), np.asarray(four, np.float64), QR_CORNER_PX, size)
            for text, four in zip(texts, () if corners is None else corners, strict=False)
            if text.rpartition("/")[2].strip()
        ]


class SheetDetector:
    """Finds the sheets whose images lie in a folder that ``sheets`` wrote."""

    def __init__(self, folder: Path) -> None:
        widths = image_widths(folder)
        files = own_files(folder)
        missing = sorted(set(files) - set(widths))
        if not files or missing:
            what = f"the width of {missing[0]}" if missing else "an image"
            raise UsageError(f"{folder}: {what} is missing; give the folder `images` that `vislam2tag sheets` wrote")
        pictures = [read_grey(path) for path in files.values()]
        self._ids = [landmark_id(name) for name in files]
        self._sizes = [
            (widths[name], widths[name] * picture.shape[0] / picture.shape[1])
            for name, picture in zip(files, pictures, strict=True)
        ]
        self._recogniser = Recogniser([reference_features(picture) for picture in pictures])
        self._features = orb(LOOK_FEATURES)

    def find(self, picture: GreyImage) -> Sequence[Seen]:
        """List the sheets that enough features of a picture agree on; one that hangs twice is there twice."""
        shrink = min(1.0, LOOK_PX / min(picture.shape))
        small = resized(picture, (round(picture.shape[1] * shrink), round(picture.shape[0] * shrink)))
        scale = picture.shape[1] / small.shape[1]
        left = features_of(small, self._features)
        found = []
        while (best := self._recogniser.best(left)).index >= 0 and best.inliers >= ENOUGH_INLIERS:
            sheet, size = self._ids[best.index], self._sizes[best.index]
            found.append(Seen(sheet, best.corners * scale, SHEET_CORNER_PX * scale, size))
            middle = best.corners.mean(axis=0)
            outside = ~_inside(left.points, middle + OWN_REACH * (best.corners - middle))
            if outside.all():
                break
            left = left.only(outside)
        return found


def _inside(points: AnyArray, corners: FloatArray) -> BoolArray:
    """Which points (n, 2) lie within a polygon (4, 2), by how often a ray to the right of each crosses its edges."""
    x, y = points.T
    inside = np.zeros(len(points), dtype=bool)
    for (x1, y1), (x2, y2) in zip(corners, np.roll(corners, 1, axis=0), strict=True):
        between = (y1 > y) != (y2 > y)
        inside ^= between & (x < x1 + (x2 - x1) * (y - y1) / (y2 - y1 if y1 != y2 else 1.0))
    return inside


Picture: TypeAlias = Callable[[], GreyImage | None]
"""Makes a picture's grey levels (height, width); None where it is damaged."""


def in_order(pictures: Pictures) -> Iterator[tuple[int, Picture]]:
    """Yield the number of each picture and the picture; of a video that is cut off those before.

    Raises SessionError where the video cannot be opened.
    """
    if pictures.video is not None and pictures.frame is not None:
        yield from _of_video(pictures.video, pictures.frame)
    else:
        for number, path in enumerate(pictures.files):
            yield number, partial(_of_file, path)


def _of_file(path: Path) -> GreyImage | None:
    grey = cv2.imdecode(np.frombuffer(read_bytes(path), np.uint8), cv2.IMREAD_GRAYSCALE)
    return None if grey is None else np.asarray(grey, np.uint8)


def _of_video(path: Path, frame: IntArray) -> Iterator[tuple[int, Picture]]:
    """As :func:`in_order`; picture number i is the video's frame number ``frame[i]``."""
    try:
        plain(path)
    except OSError as error:
        raise SessionError(f"{path}: {error.strerror}") from error
    # A phone stores how it was held as a turn for the player; poses and lens are those of the picture as it was taken.
    video = cv2.VideoCapture(str(path), cv2.CAP_FFMPEG)
    video.set(cv2.CAP_PROP_ORIENTATION_AUTO, 0)
    try:
        if not video.isOpened():
            raise SessionError(f"{path}: it is no video, or was cut off before its end: it cannot be opened")
        at = -1
        for number, wanted in enumerate(frame.tolist()):
            while at < wanted:
                at += 1
                if not video.grab():
                    return
            sound, picture = video.retrieve()
            grey = np.asarray(cv2.cvtColor(picture, cv2.COLOR_BGR2GRAY), np.uint8) if sound else None
            yield number, partial(_kept, grey)
    finally:
        video.release()


def _kept(grey: GreyImage | None) -> GreyImage | None:
    return grey
