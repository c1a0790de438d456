"""Landmarks in a session's pictures: a printed sheet of ours, a square tag of a known family, a QR code.

A quick look at few pictures is followed by a close one around what it found. A landmark is placed from its four
corners, with the uncertainty that their pixels leave.
"""

from __future__ import annotations

from collections import Counter, deque
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TypeAlias

import cv2
import numpy as np
import shapely

from vislam2tag.common.errors import SessionError, UsageError
from vislam2tag.common.files.given_files import plain, read_bytes
from vislam2tag.common.progress import Progress, silent
from vislam2tag.core.arrays import FloatArray, IntArray
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
from vislam2tag.sessions.apps import Pictures
from vislam2tag.site.model import landmark_id

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


Detector: TypeAlias = Callable[[GreyImage], Sequence[Seen]]
"""Lists the landmarks in a picture (height, width)."""


def tag_detector(family: str, side_m: float) -> Detector:
    """Make a detector of the tags of one family, whose black squares are ``side_m`` wide."""
    parameters = cv2.aruco.DetectorParameters()
    parameters.cornerRefinementMethod = cv2.aruco.CORNER_REFINE_SUBPIX
    detector = cv2.aruco.ArucoDetector(cv2.aruco.getPredefinedDictionary(TAG_FAMILIES[family]), parameters)

    def find(picture: GreyImage) -> list[Seen]:
        corners, numbers, _ = detector.detectMarkers(picture)
        found = zip(np.ravel(numbers if corners else ()).tolist(), corners, strict=True)  # no corners: numbers is None
        size = (side_m, side_m)
        return [Seen(str(number), np.asarray(four[0], np.float64), TAG_CORNER_PX, size) for number, four in found]

    return find


def sheet_tag_detector(tags: Mapping[str, SheetTag]) -> Detector:
    """Make a detector of the AprilTags that ``sheets`` printed beside pictures, by its file beside the images."""
    by_number = {str(tag.number): (landmark, tag) for landmark, tag in tags.items()}
    detect = tag_detector(TAG_FAMILY, 1.0)

    def find(picture: GreyImage) -> list[Seen]:
        seen = []
        for found in detect(picture):
            if found.landmark in by_number:
                landmark, tag = by_number[found.landmark]
                size, centre = (tag.side_m, tag.side_m), (tag.right_m, tag.up_m)
                seen.append(replace(found, landmark=landmark, size_m=size, centre_m=centre))
        return seen

    return find


def qr_detector(side_m: float) -> Detector:
    """Make a detector of QR codes of a known side whose text, or what follows its last slash, is a landmark's id."""
    detector = cv2.QRCodeDetector()

    def find(picture: GreyImage) -> list[Seen]:
        try:
            _, texts, corners, _ = detector.detectAndDecodeMulti(picture)
        except cv2.error:  # of some pictures without a code
            return []
        return [
            Seen(landmark_id(text.rpartition("/")[2]), np.asarray(four, np.float64), QR_CORNER_PX, (side_m, side_m))
            for text, four in zip(texts, () if corners is None else corners, strict=False)
            if text.rpartition("/")[2].strip()
        ]

    return find


def sheet_detector(folder: Path) -> Detector:
    """Make a detector of the sheets whose images are in a folder that ``sheets`` wrote.

    It finds the sheets that enough features of a picture agree on; one that hangs twice is there twice.
    """
    widths, files = image_widths(folder), own_files(folder)
    missing = sorted(set(files) - set(widths))
    if not files or missing:
        what = f"the width of {missing[0]}" if missing else "an image"
        raise UsageError(f"{folder}: {what} is missing; pass the folder `images` that `vislam2tag sheets` wrote")
    pictures = [read_grey(path) for path in files.values()]
    ids = [landmark_id(name) for name in files]
    sizes = [
        (widths[name], widths[name] * picture.shape[0] / picture.shape[1])
        for name, picture in zip(files, pictures, strict=True)
    ]
    recogniser = Recogniser([reference_features(picture) for picture in pictures])
    features = orb(LOOK_FEATURES)

    def find(picture: GreyImage) -> list[Seen]:
        shrink = min(1.0, LOOK_PX / min(picture.shape))
        small = resized(picture, (round(picture.shape[1] * shrink), round(picture.shape[0] * shrink)))
        scale = picture.shape[1] / small.shape[1]
        left = features_of(small, features)
        found = []
        while (best := recogniser.best(left)).index >= 0 and best.inliers >= ENOUGH_INLIERS:
            found.append(Seen(ids[best.index], best.corners * scale, SHEET_CORNER_PX * scale, sizes[best.index]))
            middle = best.corners.mean(axis=0)
            own = shapely.Polygon(middle + OWN_REACH * (best.corners - middle))
            outside = ~shapely.contains_xy(own, left.points)
            if outside.all():
                break
            left = left.only(outside)
        return found

    return find


Picture: TypeAlias = GreyImage | Path | None
"""A picture's grey levels (height, width) or its file; None where it is damaged."""


def in_order(pictures: Pictures) -> Iterator[Picture]:
    """Yield each picture; of a video that is cut off those before.

    Raises SessionError where the video cannot be opened.
    """
    if pictures.video is not None and pictures.frame is not None:
        return _of_video(pictures.video, pictures.frame)
    return iter(pictures.files)


def _grey(picture: Picture) -> GreyImage | None:
    if not isinstance(picture, Path):
        return picture
    grey = cv2.imdecode(np.frombuffer(read_bytes(picture), np.uint8), cv2.IMREAD_GRAYSCALE)
    return None if grey is None else np.asarray(grey, np.uint8)


def _of_video(path: Path, frame: IntArray) -> Iterator[Picture]:
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
            raise SessionError(f"{path}: the file cannot be opened: it is not a video, or it is incomplete")
        at = -1
        for wanted in frame.tolist():
            while at < wanted:
                at += 1
                if not video.grab():
                    return
            sound, picture = video.retrieve()
            yield np.asarray(cv2.cvtColor(picture, cv2.COLOR_BGR2GRAY), np.uint8) if sound else None
    finally:
        video.release()


QUICK_S = 0.4
"""Pictures of the quick look are so far apart: who walks by sees a landmark for a second and more."""
CLOSE_S = 0.6
"""Pictures this near to one that shows a landmark are looked at closely."""
GREATEST_SIGMA_M = 0.3
"""A sighting less sure than this, per axis, shows no more than where somebody stood."""


@dataclass(frozen=True)
class PictureSighting:
    """A landmark in one picture: ``time_ns`` of the pose that it was taken at."""

    landmark: str
    time_ns: int
    pose: Placed


@dataclass(frozen=True)
class Search:
    """What a search found: sightings in order of time, and how many corners fit no pose, or no sure one."""

    sightings: tuple[PictureSighting, ...]
    doubtful: int
    pictures: int
    """How many were there."""
    missing: int
    """Pictures that could not be unpacked, as where a video is cut off."""


def search(pictures: Pictures, detectors: Sequence[Detector], progress: Progress[int] = silent) -> Search:
    """Look for landmarks; ``progress`` counts the pictures that were passed.

    Those before a picture that shows a landmark are kept until they are too old to be looked at closely, so that no
    video is decoded twice. Raises SessionError where the pictures cannot be opened.
    """
    quick = set(_every(pictures.time_ns, QUICK_S).tolist())
    count, looked, doubtful = len(pictures.time_ns), 0, 0
    found = list[PictureSighting]()
    recent = deque[tuple[int, Picture]]()
    close_ns = round(CLOSE_S * 1e9)
    close_until_ns = -np.inf
    for number, picture in enumerate(in_order(pictures)):
        now_ns = int(pictures.time_ns[number])
        recent.append((number, picture))
        while now_ns - pictures.time_ns[recent[0][0]] > close_ns:
            recent.popleft()
        if number in quick and (grey := _grey(picture)) is not None:
            looked += 1
            if any(detect(grey) for detect in detectors):
                close_until_ns = now_ns + close_ns
        while recent and now_ns <= close_until_ns:
            seen, unsure = _closely(pictures, *recent.popleft(), detectors)
            found += seen
            doubtful += unsure
        progress(number + 1, count)
    return Search(tuple(found), doubtful, count, len(quick) - looked)


def _closely(
    pictures: Pictures, number: int, picture: Picture, detectors: Sequence[Detector]
) -> tuple[list[PictureSighting], int]:
    """The sure sightings in one picture, and how many are doubtful."""
    grey = _grey(picture)
    if grey is None:
        return [], 0
    sure, unsure = surest([detect(grey) for detect in detectors], pictures.lens_px[number])
    time_ns = int(pictures.time_ns[number])
    return [PictureSighting(name, time_ns, pose) for name, pose in sure.items()], unsure


def surest(seen: Sequence[Sequence[Seen]], lens_px: FloatArray) -> tuple[dict[str, Placed], int]:
    """Pose of each landmark in one picture, by what each detector saw, and how many sightings are doubtful.

    Of several detectors (a sheet's picture, its tag) the surest counts. A landmark that one detector sees at two places
    hangs twice: no one knows which one it is, and neither counts.
    """
    sure: dict[str, Placed] = {}
    doubtful = 0
    for of_one in seen:
        count = Counter(each.landmark for each in of_one)
        for each in of_one:
            pose = placed(each, lens_px) if count[each.landmark] == 1 else None
            if pose is None or not pose.sigma_m <= GREATEST_SIGMA_M:
                doubtful += 1
            elif each.landmark not in sure or pose.sigma_m < sure[each.landmark].sigma_m:
                sure[each.landmark] = pose
    return sure, doubtful


def _every(time_ns: IntArray, step_s: float) -> IntArray:
    """Numbers of the pictures that are the first in each step of time."""
    if not len(time_ns):
        return np.empty(0, dtype=np.int64)
    step = (time_ns - time_ns[0]) // int(step_s * 1e9)
    return np.flatnonzero(np.diff(step, prepend=-1) > 0)


MISFIT = 4.0
"""Corners further from where the pose puts them, root mean square in their own sigmas, are of something else."""
_CAMERA = np.diag((1.0, -1.0, -1.0))
"""From OpenCV's camera (y down, z ahead) to ours (y up, z back)."""
_SHEET = np.array(((1.0, 0.0, 0.0), (0.0, 0.0, -1.0), (0.0, 1.0, 0.0)))
"""A landmark's axes (x right, y out of the sheet, z down) in OpenCV's for a square (x right, y up, z out of it)."""


@dataclass(frozen=True)
class Placed:
    """A landmark's pose in the camera's frame: ``position_m`` (3,), ``orientation`` (4,) quaternion (x, y, z, w),
    landmark to camera, and ``sigma_m`` of its position per axis.
    """

    position_m: FloatArray
    orientation: FloatArray
    sigma_m: float


def placed(seen: Seen, lens_px: FloatArray) -> Placed | None:
    """Place a landmark by the lens (4,) fx, fy, cx, cy, pixels; None where its corners fit no pose.

    Of the two poses that a small square far away has (Collins and Bartoli, IJCV 2014), each brought to the nearest of
    least squares, the one that fits better; its position hardly differs. The covariance is that of least squares, by
    the derivatives of the projection.
    """
    from scipy.spatial.transform import Rotation

    width, height = seen.size_m
    square = np.array(((-1, 1, 0), (1, 1, 0), (1, -1, 0), (-1, -1, 0)), np.float64) * (width / 2, height / 2, 0)
    middle = np.array((*seen.centre_m, 0.0))
    camera = np.array(((lens_px[0], 0, lens_px[2]), (0, lens_px[1], lens_px[3]), (0, 0, 1)), np.float64)
    if not np.isfinite(seen.corners_px).all() or not np.isfinite(camera).all():
        return None
    found = _poses(square, seen.corners_px, camera)
    if not found:
        return None
    _, turn, shift = min(found, key=lambda pose: pose[0])
    if seen.centre_m != (0.0, 0.0):  # the derivative below is that of the landmark's own place
        shift = shift - cv2.Rodrigues(turn)[0] @ middle[:, None]
        square = square + middle
    again, derivative = cv2.projectPoints(square, turn, shift, camera, np.zeros(4))
    misfit = (again[:, 0] - seen.corners_px) / seen.sigma_px
    if float(np.sqrt(np.mean(misfit**2))) > MISFIT:
        return None
    normal = derivative[:, :6].T @ derivative[:, :6]
    covariance = seen.sigma_px**2 * np.linalg.pinv(normal)
    rotation = _CAMERA @ cv2.Rodrigues(turn)[0] @ _SHEET
    return Placed(
        _CAMERA @ shift[:, 0],
        Rotation.from_matrix(rotation).as_quat(),
        float(np.sqrt(np.trace(covariance[3:, 3:]) / 3)),
    )


def _poses(
    square: FloatArray, corners_px: FloatArray, camera: FloatArray
) -> list[tuple[float, FloatArray, FloatArray]]:
    """How far corners are off, root mean square, pixels, turn (3, 1) and shift (3, 1) of poses that may fit."""
    found = list[tuple[float, FloatArray, FloatArray]]()
    for way in (cv2.SOLVEPNP_IPPE, cv2.SOLVEPNP_ITERATIVE):  # the first is lost exactly in front of a square
        with suppress(cv2.error):
            _, turns, shifts, _ = cv2.solvePnPGeneric(square, corners_px, camera, np.zeros(4), flags=way)
            for rough in zip(turns, shifts, strict=True):
                finer = cv2.solvePnPRefineLM(square, corners_px, camera, np.zeros(4), *rough)
                turn, shift = (np.asarray(one, np.float64) for one in finer)
                off = cv2.projectPoints(square, turn, shift, camera, np.zeros(4))[0][:, 0] - corners_px
                if np.isfinite(off).all() and shift[2, 0] > 0:
                    found.append((float(np.sqrt(np.mean(off**2))), turn, shift))
    return found
