"""What a phone's camera sees of a sheet on a wall: distance, tilt, blur, dim light and noise."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TypeAlias

import cv2
import numpy as np

from vislam2tag.core.arrays import FloatArray
from vislam2tag.preparation.sheets.features import GreyImage, resized

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


@dataclass(frozen=True)
class CameraFrame:
    """A camera frame and where the image's corners (4, 2) truly lie in it, pixels: from the upper left, clockwise."""

    image: GreyImage
    corners: FloatArray


def bordered(image: GreyImage) -> tuple[GreyImage, Rectangle]:
    """Put a white border around an image (height, width), as the paper that it is printed on."""
    height, width = image.shape
    edge = round(_BORDER * width)
    return np.pad(image, edge, constant_values=255), (edge, edge, width, height)


def camera_frame(paper: GreyImage, image: Rectangle, view: View, wall: GreyImage, seed: int = 0) -> CameraFrame:
    """Look at a sheet of paper (height, width) on a wall; ``image`` is where on the paper the image stands.

    ``wall`` has the frame's size and is what stands behind the sheet.
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
    return CameraFrame(lit, cv2.perspectiveTransform(corners[None], frame_T_image)[0])


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
