"""Which image of a set a frame shows: votes of nearest features, then a homography that enough of them obey."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import cv2
import numpy as np

from vislam2tag.core.arrays import FloatArray
from vislam2tag.preparation.sheets.features import Features

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
        cut = (0, 0) if but is None else (int(self._first[but]), int(self._first[but + 1]))
        distance = np.full(len(seen), np.inf)
        nearest = np.full(len(seen), -1)
        for start, stop in ((0, cut[0]), (cut[1], len(self._all))):
            for match in self._matcher.match(seen.descriptors, self._all[start:stop]) if stop > start else ():
                if match.distance < distance[match.queryIdx]:
                    distance[match.queryIdx], nearest[match.queryIdx] = match.distance, start + match.trainIdx
        votes = np.bincount(self._owner[nearest[nearest >= 0]], minlength=len(self._references))
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
    """Distance of descriptors: differing bits, or Euclidean where they are no bits."""
    return int(cv2.NORM_HAMMING if features.descriptors.dtype == np.uint8 else cv2.NORM_L2)
