"""Record3D for iOS: recognised, and refused with the reason.

Its poses (``metadata``: quaternion and position) are in a frame that starts as the phone was held, not levelled by
gravity, and it logs no accelerometer by which they could be.
"""

from __future__ import annotations

from pathlib import Path

from vislam2tag.common.errors import SessionError
from vislam2tag.sessions.model import Session
from vislam2tag.sessions.registry import register
from vislam2tag.sessions.settings import FindingSettings
from vislam2tag.site.model import SessionRef
from vislam2tag.site.site_table import is_file

_METADATA = ("metadata", "metadata.json", "EXR_RGBD/metadata.json")
_PICTURES = ("rgbd", "rgb", "EXR_RGBD/rgb")


class Record3dFormat:
    """Recognises what Record3D exports, so that it is named."""

    name = "record3d"

    def recognises(self, folder: Path) -> bool:
        """Its metadata lie beside its pictures."""
        return any(
            is_file(folder / metadata) and (folder / pictures).is_dir()
            for metadata, pictures in zip(_METADATA, _PICTURES, strict=True)
        )

    def input_files(self, folder: Path) -> list[Path]:
        """The metadata."""
        return [folder / name for name in _METADATA if is_file(folder / name)]

    def read(self, ref: SessionRef, settings: FindingSettings) -> Session:
        """Raise SessionError: nothing tells which way is up."""
        del settings
        raise SessionError(
            f"{ref.key}: Record3D does not level its frame by gravity and logs no accelerometer to level it by: "
            "nothing tells where the floor is: record with Stray Scanner or another app of docs/how-to/iphone.md"
        )


register(Record3dFormat())
