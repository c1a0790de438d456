"""A session's pictures in grey, in their order: a video is decoded once, a file only where its picture is wanted."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from functools import partial
from pathlib import Path
from typing import TypeAlias

import cv2
import numpy as np

from vislam2tag.common.errors import SessionError
from vislam2tag.common.files.plain_files import plain, read_bytes
from vislam2tag.core.arrays import IntArray
from vislam2tag.sessions.apps import Pictures
from vislam2tag.sheets.features import GreyImage

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
