"""Features of landmark images and whether a recogniser finds them again, in simulated views."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TypeAlias

import cv2
import numpy as np
import numpy.typing as npt

from vislam2tag.core.arrays import AnyArray, BoolArray, FloatArray

GreyImage: TypeAlias = npt.NDArray[np.uint8]
"""Grey levels (height, width), 0 black to 255 white; recognisers use no colour."""

REFERENCE_PX = 400
"""Length of an image's shorter side when its features are taken, as a recogniser stores it."""
BITS = 256
"""Length of an ORB descriptor."""
_EDGE_PX = 16
"""How near to the edge of an image features are taken: half of what a descriptor looks at."""


@dataclass(frozen=True)
class Features:
    """Features of one image, ``k`` of them, the strongest first.

    ``points`` (k, 2) pixels; ``descriptors`` (k, 32) bytes of bits, or (k, d) floats where a detector makes such;
    ``size_px`` is width and height of the image that the points lie in.
    """

    points: npt.NDArray[np.float32]
    descriptors: AnyArray
    size_px: tuple[int, int]

    def __len__(self) -> int:
        return len(self.points)

    def strongest(self, count: int) -> Features:
        """Keep the first ``count``."""
        return Features(self.points[:count], self.descriptors[:count], self.size_px)

    def only(self, wanted: BoolArray) -> Features:
        """Keep those that ``wanted`` (k,) says."""
        return Features(self.points[wanted], self.descriptors[wanted], self.size_px)


def orb(count: int) -> cv2.Feature2D:
    """Make an ORB detector of the ``count`` strongest features (Rublee et al., ICCV 2011)."""
    return cv2.ORB.create(nfeatures=count, edgeThreshold=_EDGE_PX)


def features_of(image: GreyImage, detector: cv2.Feature2D) -> Features:
    """Find the features of an image (height, width) as it is."""
    found, descriptors = detector.detectAndCompute(image, None)
    height, width = image.shape
    if not found:
        return Features(np.empty((0, 2), np.float32), np.empty((0, BITS // 8), np.uint8), (width, height))
    order = np.argsort([-point.response for point in found], kind="stable")
    points = np.array([point.pt for point in found], np.float32)
    return Features(points[order], np.asarray(descriptors)[order], (width, height))


def reference(image: GreyImage) -> GreyImage:
    """Bring an image (height, width) to the size at which its features are taken: its shorter side
    :data:`REFERENCE_PX`.
    """
    scale = REFERENCE_PX / min(image.shape)
    return resized(image, (round(image.shape[1] * scale), round(image.shape[0] * scale)))


def resized(image: GreyImage, size_px: tuple[int, int]) -> GreyImage:
    """Bring an image (height, width) to another size; the mean of areas where it shrinks, as a lens does."""
    shrinks = size_px[0] < image.shape[1]
    way = cv2.INTER_AREA if shrinks else cv2.INTER_LINEAR
    return np.asarray(cv2.resize(image, size_px, interpolation=way), np.uint8)


FRAME_PX = (640, 480)
"""The frame in which ARCore looks for images, width and height."""
_FOCAL_PX = 500.0
"""65 degrees across the frame, as phones' main cameras have."""
Rectangle: TypeAlias = tuple[int, int, int, int]
"""Left, top, width and height, pixels."""
_BORDER = 0.05
"""White paper around the image, as a share of its width."""


@dataclass(frozen=True)
class View:
    """How a sheet is looked at."""

    share: float = 0.25
    """Share of the frame that the image would fill if it were faced; ARCore asks for 25 %."""
    roll_deg: float = 0.0
    """The phone turned about its line of sight."""
    yaw_deg: float = 0.0
    """The sheet turned away to one side."""
    pitch_deg: float = 0.0
    """The sheet turned away upwards."""
    blur_px: float = 0.0
    """Standard deviation of the blur."""
    light: float = 1.0
    """Exposure, of a well-lit frame's."""
    noise: float = 2.0
    """Standard deviation of the sensor's noise, grey levels."""


def bordered(image: GreyImage) -> tuple[GreyImage, Rectangle]:
    """Put a white border around an image (height, width), as the paper that it is printed on."""
    height, width = image.shape
    edge = round(_BORDER * width)
    return np.pad(image, edge, constant_values=255), (edge, edge, width, height)


def camera_frame(
    paper: GreyImage, image: Rectangle, view: View, wall: GreyImage, seed: int = 0
) -> tuple[GreyImage, FloatArray]:
    """Look at a sheet of paper (height, width) on a wall; ``image`` is where on the paper the image is.

    Returns the camera frame, and where the image's corners (4, 2) lie in it, pixels: from the upper left, clockwise.
    ``wall`` has the frame's size and is the background behind the sheet.
    """
    left, top, width, height = image
    corners = np.array([(0, 0), (width, 0), (width, height), (0, height)], np.float64)
    frame_T_image = _projection(view, width, height)
    frame_T_paper = frame_T_image @ np.array([(1, 0, -left), (0, 1, -top), (0, 0, 1)], np.float64)
    shrunk, frame_T_shrunk = _without_aliasing(paper, frame_T_paper, view, width * height)
    frame = cv2.warpPerspective(
        shrunk, frame_T_shrunk, FRAME_PX, dst=wall.copy(), flags=cv2.INTER_LINEAR, borderMode=cv2.BORDER_TRANSPARENT
    )
    if view.blur_px:
        frame = cv2.GaussianBlur(frame, (0, 0), view.blur_px)
    noise = np.random.default_rng(seed).normal(0, view.noise, frame.shape)
    lit: GreyImage = np.clip(frame * view.light + noise, 0, 255).astype(np.uint8)
    return lit, cv2.perspectiveTransform(corners[None], frame_T_image)[0]


def _projection(view: View, width: int, height: int) -> FloatArray:
    """Homography (3, 3) from the image's pixels to the frame's, by a pinhole camera that looks at its centre."""
    roll, yaw, pitch = np.radians((view.roll_deg, view.yaw_deg, view.pitch_deg))
    turned = _about(2, roll) @ _about(1, yaw) @ _about(0, pitch)
    pixels_a_side = np.sqrt(view.share * FRAME_PX[0] * FRAME_PX[1])
    side = np.sqrt(width * height)
    plane_T_image = np.array([(1 / side, 0, -width / 2 / side), (0, 1 / side, -height / 2 / side), (0, 0, 1)])
    camera_T_plane = np.column_stack((turned[:, 0], turned[:, 1], (0, 0, _FOCAL_PX / pixels_a_side)))
    frame_T_camera = np.array([(_FOCAL_PX, 0, FRAME_PX[0] / 2), (0, _FOCAL_PX, FRAME_PX[1] / 2), (0, 0, 1)])
    homography: FloatArray = frame_T_camera @ camera_T_plane @ plane_T_image
    return homography


def _about(axis: int, angle: float) -> FloatArray:
    """Rotation (3, 3) about one axis."""
    rotation = np.eye(3)
    others = [i for i in range(3) if i != axis]
    rotation[np.ix_(others, others)] = ((np.cos(angle), -np.sin(angle)), (np.sin(angle), np.cos(angle)))
    return rotation


def _without_aliasing(
    paper: GreyImage, frame_T_paper: FloatArray, view: View, image_px: int
) -> tuple[GreyImage, FloatArray]:
    """Shrink a sheet (height, width) to about its size in the frame by areas, as a lens does, before it is warped."""
    scale = float(np.sqrt(view.share * FRAME_PX[0] * FRAME_PX[1] / image_px))
    if scale >= 1:
        return paper, frame_T_paper
    size = (max(1, round(paper.shape[1] * scale)), max(1, round(paper.shape[0] * scale)))
    back = np.diag((paper.shape[1] / size[0], paper.shape[0] / size[1], 1.0))
    return resized(paper, size), frame_T_paper @ back


ENOUGH_INLIERS = 20
"""Features that must agree on a homography before an image counts as recognised; chance reaches 10."""
FEATURES = 400
"""Features kept of an image, the strongest."""
FRAME_FEATURES = 800
"""Features taken of a camera frame, which shows more than the sheet."""
VOTERS = 100
"""Features of an image that suffice for votes between images; frames from afar need all of them."""
_CANDIDATES = 5
"""Images with the most votes that are looked at closely."""
_RATIO = 0.8
"""A match counts if the next best is this much worse (Lowe, IJCV 2004)."""
_REACH = 0.015
"""How far an inlier may lie from where the homography puts it, sides of the frame."""
_FEWEST = 8
"""Matches below which no homography is sought: any four agree on one."""
_NOWHERE = np.full((4, 2), np.nan)


@dataclass(frozen=True)
class Sighting:
    """An image of the set found in a frame: its index, and how many features agree."""

    index: int
    inliers: int
    corners: FloatArray
    """(4, 2) where its corners lie in the frame, pixels: from the upper left, clockwise; NaN where there is none."""


class Recogniser:
    """The features of a set of images, searched exactly.

    ``voters`` is how many features of each image votes are counted by.
    """

    def __init__(self, references: Sequence[Features], voters: int = FEATURES) -> None:
        self._voters = voters
        descriptors = [features.strongest(voters).descriptors for features in references]
        counts = [len(rows) for rows in descriptors]
        self._references = tuple(references)
        self._first = np.concatenate(([0], np.cumsum(counts)))
        self._owner = np.repeat(np.arange(len(counts)), counts)
        self._all = np.concatenate(descriptors)
        self._matcher = cv2.BFMatcher(_norm(references[0]))

    def best(self, seen: Features) -> Sighting:
        """Find the image that most features of a frame agree on; index -1 where none comes near."""
        return self._best_of(seen, self._most_voted(seen, None))

    def most_like(self, index: int) -> Sighting:
        """Find the other image of the set that an image could most easily be taken for."""
        features = self._references[index]
        return self._best_of(features, self._most_voted(features.strongest(self._voters), index))

    def _best_of(self, seen: Features, candidates: list[int]) -> Sighting:
        found = [sighting(seen, self._references[index], index) for index in candidates]
        return max(found, key=lambda one: one.inliers, default=Sighting(-1, 0, _NOWHERE))

    def _most_voted(self, seen: Features, but: int | None) -> list[int]:
        """Indices of the images that own the nearest of the whole set to most features, most votes first."""
        mask = None
        if but is not None:
            mask = np.ones((len(seen), len(self._all)), np.uint8)
            mask[:, self._first[but] : self._first[but + 1]] = 0
        nearest = [match.trainIdx for match in self._matcher.match(seen.descriptors, self._all, mask)]
        votes = np.bincount(self._owner[np.array(nearest, np.int64)], minlength=len(self._references))
        order = np.argsort(-votes, kind="stable")[:_CANDIDATES]
        return [int(index) for index in order if votes[index]]


def sighting(seen: Features, reference: Features, index: int = 0) -> Sighting:
    """Match a frame with one image, and count the features that one homography explains."""
    if len(seen) < ENOUGH_INLIERS or len(reference) < ENOUGH_INLIERS:
        return Sighting(index, 0, _NOWHERE)
    pairs = cv2.BFMatcher(_norm(seen)).knnMatch(seen.descriptors, reference.descriptors, k=2)
    clear = [best for best, second in pairs if best.distance < _RATIO * second.distance]
    if len(clear) < _FEWEST:
        return Sighting(index, 0, _NOWHERE)
    there = seen.points[[match.queryIdx for match in clear]]
    here = reference.points[[match.trainIdx for match in clear]]
    homography, agree = cv2.findHomography(here, there, cv2.RANSAC, _REACH * min(seen.size_px))
    if not np.shape(homography):  # no four matches in general position
        return Sighting(index, 0, _NOWHERE)
    width, height = reference.size_px
    corners = np.array([[(0, 0), (width, 0), (width, height), (0, height)]], np.float64)
    return Sighting(index, int(agree.sum()), cv2.perspectiveTransform(corners, homography)[0])


def _norm(features: Features) -> int:
    """Distance of descriptors: differing bits, or Euclidean where they are not bits."""
    return int(cv2.NORM_HAMMING if features.descriptors.dtype == np.uint8 else cv2.NORM_L2)
