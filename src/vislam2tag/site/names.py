"""File-name stems for sessions: safe on every file system, unique in the survey, always the same."""

from __future__ import annotations

import hashlib
import re
import unicodedata
from collections import Counter
from collections.abc import Sequence

from vislam2tag.site.model import SessionKey

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
    parts = [(str(key.floor), key.device, key.session) for key in keys]
    return unique_slugs(
        [".".join((f"floor_{floor}", device, session)) for floor, device, session in parts],
        ["\0".join(part) for part in parts],
    )


def unique_slugs(names: Sequence[str], exact: Sequence[str] | None = None) -> tuple[str, ...]:
    """Make a slug of each name; ``exact`` tells names apart where the names alone do not.

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
