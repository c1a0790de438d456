"""A site as it is read: floors with plan and control points, landmarks, keys of sessions, and names of their files."""

from __future__ import annotations

import hashlib
import re
import unicodedata
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, ClassVar

import numpy as np

from vislam2tag.common.files.store import Listed, Store
from vislam2tag.common.findings import Finding
from vislam2tag.common.tabular import Frames, TabularResult, column_frame, listed_frame
from vislam2tag.core.arrays import FloatArray
from vislam2tag.core.notebook import Drawable
from vislam2tag.core.tracks import Landmarks
from vislam2tag.core.transforms import Similarity2
from vislam2tag.site.georeference import Georeference
from vislam2tag.site.plans.source import PlanSource

if TYPE_CHECKING:
    import polars as pl

COMPANIONS = "companions"
"""Folder of a session that says which recordings of other devices belong to it, and may contain them."""


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
    """Where a session is and which format its folder has (a registered name)."""

    key: SessionKey
    folder: Path
    format: str
    slug: str
    """File-name stem of this session's outputs: unique in the survey, letters, digits, ``.``, ``_`` and ``-`` only."""
    stored: StoredFolder | None = None
    """Where the session is in an object store; ``folder`` then has the names of its files, without their content."""
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


def is_own_name(name: str, number: int) -> bool:
    """Whether the name of a floor says more than its number, such as "Ground floor"."""
    return name.casefold() not in ("", str(number), f"floor {number}")


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
    """Where the BCS is on the earth."""
    mask: Path | None = None
    """Image of corrections of where the floor can be walked, where its folder has one."""
    rooms: Path | None = None
    """Table of its rooms' names, where its folder has one."""
    excluded_rooms: tuple[str, ...] = ()
    """Names of rooms in which no one walks for the survey: tours and coverage leave them out."""
    site_T_bcs: Similarity2 = field(default_factory=Similarity2.identity)
    """From this floor's BCS to the frame that all floors of the site share; its scale is 1."""
    stored_plan: StoredFile | None = None
    """Where the plan is in an object store; ``plan`` is then a copy that other machines do not have."""
    stored_mask: StoredFile | None = None
    """The same for ``mask``."""

    @property
    def title(self) -> str:
        """Name and number as a heading: "Ground floor (floor 0)", or "Floor 0" if the name does not say more."""
        return f"{self.name} (floor {self.number})" if is_own_name(self.name, self.number) else f"Floor {self.number}"

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
class Survey(Drawable, TabularResult):
    """A survey folder, looked at but not read: the site, its sessions and what is odd about them."""

    main_table: ClassVar[str] = "sessions"

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

    def _frames(self) -> Frames:
        return {
            "sessions": partial(listed_frame, self.sessions),
            "landmarks": self._landmark_frame,
            "findings": partial(listed_frame, self.findings),
        }

    def _landmark_frame(self) -> pl.DataFrame:
        """Landmarks in the BCS of their floors, metres; null if a value is not known."""
        marks = self.site.landmarks
        columns = ("x", "y", "z", "heading_rad")
        values = (*marks.position_bcs.T, marks.z_m, marks.heading_rad)
        return column_frame({"id": marks.ids, "floor": marks.floor, **dict(zip(columns, values, strict=True))})


_UNSAFE = re.compile(r"[^A-Za-z0-9._-]+")
_RESERVED = re.compile(r"(con|prn|aux|nul|conin\$|conout\$|com[0-9¹²³]|lpt[0-9¹²³]) *(\..*)?", re.IGNORECASE)
"""Names that Windows keeps for devices, whatever their suffix."""
_UNPORTABLE = re.compile(r'[\x00-\x1f\x7f<>:"/\\|?*]')
"""Characters that a name cannot have on every system."""
_GREATEST_NAME = 255
_SUFFIX_LENGTH = 8
_GREATEST_STEM = 120
"""File systems allow 255 bytes; this leaves room for suffixes."""


def is_reserved(name: str) -> bool:
    """Whether Windows keeps a name for a device, as ``con`` or ``aux.csv``."""
    return _RESERVED.fullmatch(name) is not None


def is_portable(name: str) -> bool:
    """Whether every file system takes a name and keeps it as it is: of one file or folder, without its path."""
    fits = 0 < len(name.encode("utf-8", "replace")) <= _GREATEST_NAME
    return fits and name[-1] not in " ." and not _UNPORTABLE.search(name) and not is_reserved(name)


def portable_name(name: str) -> str:
    """Make a name that every file system takes; empty if nothing of it is left.

    Characters that some systems refuse become ``-``, blanks and dots around it go, as do the last characters of a long
    one, and names that Windows keeps for devices get ``_`` in front.
    """
    plain = _UNPORTABLE.sub("-", name).strip(" .").encode("utf-8", "ignore")[: _GREATEST_NAME - 1]
    kept = plain.decode("utf-8", "ignore").strip(" .")
    return f"_{kept}" if is_reserved(kept) else kept


def same_name(name: str) -> str:
    """Return the form by which names are compared: two of one form are one file on some systems."""
    return unicodedata.normalize("NFC", name).casefold()


def session_slugs(keys: Sequence[SessionKey]) -> tuple[str, ...]:
    """Give each session its slug, e.g. ``floor_4.LG_ref.2022-01-14T163530``."""
    names, exact = ([mark.join((str(key.floor), key.device, key.session)) for key in keys] for mark in (".", "\0"))
    return unique_slugs([f"floor_{name}" for name in names], exact)


def unique_slugs(names: Sequence[str], exact: Sequence[str] | None = None) -> tuple[str, ...]:
    """Make a slug of each name; ``exact`` distinguishes names if the names alone do not.

    Colons go, other unsafe characters become ``-``. Slugs that would collide (also on a file system that
    ignores case), be too long or be a name that Windows does not allow get a short hash of the exact names.
    """
    stems = [_UNSAFE.sub("-", name.replace(":", "")) for name in names]
    uses = Counter(stem.lower() for stem in stems)

    def slug(stem: str, key: str) -> str:
        reserved = is_reserved(stem)
        if uses[stem.lower()] == 1 and len(stem) <= _GREATEST_STEM and not reserved and not stem.endswith("."):
            return stem
        digest = hashlib.sha256(key.encode("utf-8", "surrogateescape")).hexdigest()[:_SUFFIX_LENGTH]
        return f"{'_' if reserved else ''}{stem[:_GREATEST_STEM]}-{digest}"

    return tuple(map(slug, stems, exact or names))


_WHOLE_NUMBER = re.compile(r"(?:\+|(-))?0*([0-9]+)(?:[.,]0*)?")
_UNUSABLE = re.compile(r"[\x00-\x1f\x7f;\ufffd]")


def landmark_id(text: str) -> str:
    """Bring an id to its one form: ``" 10"``, ``"010"``, ``"+10"`` and ``"10.0"`` are ``"10"``.

    Whole numbers lose leading zeros and the plus sign, because other programs read such columns as numbers.

    Returns the empty string for what cannot be an id: blank, control characters, undecodable bytes.
    """
    stripped = text.strip()
    if _UNUSABLE.search(stripped):
        return ""
    number = _WHOLE_NUMBER.fullmatch(stripped)
    if not number:
        return stripped
    sign, digits = number.groups()
    return f"-{digits}" if sign and digits != "0" else str(digits)


_ABOVE = re.compile(r"^[FL](\d+)$|^(\d+)F$", re.IGNORECASE)
_BELOW = re.compile(r"^(?:B|LG)(\d*)$|^BF$", re.IGNORECASE)


def floor_number(name: str) -> int | None:
    """Number of a floor from its name, as the competition counts: F1, 1F, L1 and G are 0, B1 and LG1 are -1.

    None for names without a place in that order, such as mezzanines (M, BM).
    """
    if name.upper() == "G":
        return 0
    if match := _ABOVE.match(name):
        return int(match[1] or match[2]) - 1
    if match := _BELOW.match(name):
        return -int(match[1] or 1)
    return None
