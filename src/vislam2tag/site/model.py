"""A site as it is read: floors with plan and control points, landmarks, keys of sessions; settings of reading it."""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from vislam2tag.common.files.store import Listed, Store
from vislam2tag.common.findings import Finding
from vislam2tag.core.arrays import FloatArray
from vislam2tag.core.notebook import Drawable
from vislam2tag.core.similarity import Similarity2
from vislam2tag.core.tracks import Landmarks
from vislam2tag.site.georeference import Georeference
from vislam2tag.site.plans.source import PlanSource

COMPANIONS = "companions"
"""Folder of a session that says which recordings of other devices belong to it, and may hold them."""


@dataclass(frozen=True, order=True)
class SessionKey:
    """What identifies a session: floor number, device name and folder name (as on disk)."""

    floor: int
    device: str
    session: str

    def __str__(self) -> str:
        return f"floor {self.floor} / {self.device} / {self.session}"


@dataclass(frozen=True)
class StoredFolder:
    """A session's folder in a store (or the one file that a session is), as it was listed."""

    store: Store
    """That of the survey."""
    name: str
    """Path below the survey."""
    files: tuple[Listed, ...]
    """Those in it, the zip of its name beside it where it is read from one, and recordings elsewhere in the survey that
    are tied to it.
    """

    @property
    def address(self) -> str:
        """Address of the folder."""
        return f"{self.store.address}/{self.name}"


@dataclass(frozen=True)
class StoredFile:
    """A file in a store, as it was when the survey was opened."""

    store: Store
    """That of the survey."""
    name: str
    """Path below the survey."""
    sha256: str


@dataclass(frozen=True)
class SessionRef:
    """Where a session lies and which format its folder has (a registered name)."""

    key: SessionKey
    folder: Path
    format: str
    slug: str
    """File-name stem of this session's outputs: unique in the survey, letters, digits, ``.``, ``_`` and ``-`` only."""
    stored: StoredFolder | None = None
    """Where the session lies in an object store; ``folder`` then has the names of its files, without their content."""
    packed: Path | None = None
    """The zip beside ``folder`` that the session is read from; ``folder`` then has what was found in it since."""
    beside: Path | None = None
    """Of a session that is unpacked in ``folder`` just now: the folder beside its zip."""
    from_outside: bool = False
    """Whether links lead to any of its files outside the survey."""

    @property
    def own(self) -> Path:
        """The folder that is written to: of what is found in the session, and of what is tied to it."""
        return self.beside or self.folder


@dataclass(frozen=True)
class ControlPoints:
    """Surveyed points on the floor that an evaluation walk presses at; ``position_bcs`` (p, 2) metres."""

    ids: tuple[str, ...]
    position_bcs: FloatArray
    source: tuple[str, ...] = ()
    """(p) file and 1-based line of each, ``floor_1/refmarker.csv:3``; empty where they come from no file."""


@dataclass(frozen=True)
class Floor:
    """One floor of the site, in its own BCS (its origin is the plan's lower left where nothing says else)."""

    number: int
    name: str
    width_m: float | None
    """Extent of the plan along x, metres; None where no file gives it."""
    height_m: float | None
    """Extent of the plan along y, metres."""
    elevation_m: float | None
    plan: Path | None
    """File that shows exactly width x height, where there is one: an image, or what ``source`` says."""
    control_points: ControlPoints
    lower_left_m: tuple[float, float] = (0.0, 0.0)
    """Lower left corner of what the plan shows, BCS."""
    source: PlanSource | None = None
    """How the plan's file is to be read and placed; None: an image that covers the extent."""
    georeference: Georeference | None = None
    """Where the BCS lies on the earth."""
    mask: Path | None = None
    """Image of corrections of where the floor can be walked, where its folder has one."""
    rooms: Path | None = None
    """Table of its rooms' names, where its folder has one."""
    site_T_bcs: Similarity2 = field(default_factory=Similarity2.identity)
    """From this floor's BCS to the frame that all floors of the site share; its scale is 1."""
    stored_plan: StoredFile | None = None
    """Where the plan lies in an object store; ``plan`` is then a copy that other machines do not have."""

    @property
    def extent_m(self) -> tuple[float, float, float, float] | None:
        """Left, right, lower and upper edge of the plan, BCS; None where no file gives them."""
        if self.width_m is None or self.height_m is None:
            return None
        left, low = self.lower_left_m
        return left, left + self.width_m, low, low + self.height_m

    @property
    def corners_m(self) -> FloatArray:
        """Lower left and upper right corner (2, 2) of the plan, BCS; (0, 2) where no file gives them."""
        if self.extent_m is None:
            return np.empty((0, 2))
        left, right, low, high = self.extent_m
        return np.array([(left, low), (right, high)])


@dataclass(frozen=True)
class Site:
    """The building: its floors and all landmarks (``landmarks.floor`` says where each one is)."""

    floors: tuple[Floor, ...]
    landmarks: Landmarks

    def floor(self, number: int) -> Floor:
        """Return the floor with this number; raises KeyError where there is none."""
        for floor in self.floors:
            if floor.number == number:
                return floor
        raise KeyError(number)


@dataclass(frozen=True, repr=False)
class Survey(Drawable):
    """A survey folder, looked at but not read: the site, its sessions and what is odd about them."""

    root: Path
    site: Site
    sessions: tuple[SessionRef, ...]
    """Sorted by key."""
    findings: tuple[Finding, ...]
    """What is odd about the site's own files."""

    def _facts(self) -> dict[str, object]:
        return {
            "folder": self.root,
            "floors": len(self.site.floors),
            "landmarks": len(self.site.landmarks.ids),
            "sessions": len(self.sessions),
            "findings": len(self.findings),
        }
