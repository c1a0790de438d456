"""``session.json`` of the phone app: who recorded what with which phone, and how it ended.

docs/reference/phone-format.md tells more.
"""

from __future__ import annotations

import re
from typing import Literal

from pydantic import Field, ValidationError

from vislam2tag.common.errors import SessionError
from vislam2tag.common.records import Record

RECORD_FILE = "session.json"
VERSION = 1
SESSION_NAME = re.compile(r"[0-9]{4}-[0-9]{2}-[0-9]{2}T[0-9]{6}(-[0-9]{1,6})?")
DEVICE_NAME = re.compile(r"[A-Za-z0-9]([A-Za-z0-9._ -]{0,62}[A-Za-z0-9_-])?")
STOPPED, KILLED = "stopped", "killed"


class _Model(Record, extra="ignore"):
    """Newer apps may say more."""


class RecordingEnd(_Model):
    """How and when a recording ended; times are None where they are not known."""

    state: str = Field(pattern=r"^[a-z_]{1,40}$")
    detail: str = ""
    wall_ms: int | None = None
    boot_ns: int | None = None


class Phone(_Model):
    """What the phone is."""

    manufacturer: str = ""
    model: str = ""
    android: str = ""
    arcore: str | None = None


class PhoneRecord(_Model):
    """What readers use of ``session.json``; other keys are ignored."""

    format: Literal["vislam2tag-phone"]
    version: Literal[1]
    session: str = Field(pattern=f"^{SESSION_NAME.pattern}$")
    floor: int = Field(ge=-999999, le=999999)
    device: str = Field(pattern=f"^{DEVICE_NAME.pattern}$")
    site: str = ""
    note: str = ""
    phone: Phone = Phone()
    end: RecordingEnd | None = None

    @property
    def ended(self) -> str:
        """How the recording ended; one that never said so was killed."""
        return self.end.state if self.end else KILLED


def parse_record(data: bytes, file: str) -> PhoneRecord:
    """Read ``session.json``; raises ValueError, one sentence, where it is none, SessionError for an unknown version."""
    try:
        return PhoneRecord.model_validate_json(data)
    except ValidationError as error:
        wrong = error.errors()[0]
        where = ".".join(map(str, wrong["loc"])) or "the file"
        if where == "version" and isinstance(wrong["input"], int):
            raise SessionError(
                f"{file}: version {wrong['input']!s:.20} of the phone's format; this program reads {VERSION}: update it"
            ) from error
        raise ValueError(f"{where}: {wrong['msg']}") from error
