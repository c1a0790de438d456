"""A session's pictures in grey, one at a time, in their order: only those that are asked for are unpacked."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import cv2
import numpy as np

from vislam2tag.common.errors import SessionError
from vislam2tag.common.files.plain_files import plain, read_bytes
from vislam2tag.core.arrays import IntArray
from vislam2tag.sessions.apps.pictures import Pictures
from vislam2tag.sheets.features import GreyImage


def unpacked(pictures: Pictures, wanted: IntArray) -> Iterator[tuple[int, GreyImage]]:
    """Yield the number of each wanted picture (k,), ascending, and its grey levels (height, width).

    Pictures that are damaged are passed over. Raises SessionError where the video cannot be opened.
    """
    if pictures.video is not None and pictures.frame is not None:
        yield from _of_video(pictures.video, pictures.frame, wanted)
    else:
        for number in wanted.tolist():
            grey = cv2.imdecode(np.frombuffer(read_bytes(pictures.files[number]), np.uint8), cv2.IMREAD_GRAYSCALE)
            if grey is not None:
                yield number, np.asarray(grey, np.uint8)


def _of_video(path: Path, frame: IntArray, wanted: IntArray) -> Iterator[tuple[int, GreyImage]]:
    """As :func:`unpacked`; picture number i is the video's frame number ``frame[i]``."""
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
        for number in wanted.tolist():
            while at < frame[number]:
                at += 1
                if not video.grab():
                    return
            sound, picture = video.retrieve()
            if sound:
                yield number, np.asarray(cv2.cvtColor(picture, cv2.COLOR_BGR2GRAY), np.uint8)
    finally:
        video.release()
