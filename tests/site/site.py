"""A small survey folder to break in tests."""

from __future__ import annotations

import io
from pathlib import Path

from PIL import Image

from tests.sessions.raw import clean_files, write_session


def plan_bytes(kind: str) -> bytes:
    """Return a small image as the bytes of a file; ``kind`` is a format of Pillow's, such as ``JPEG``."""
    buffer = io.BytesIO()
    Image.linear_gradient("L").resize((60, 30)).save(buffer, kind)
    return buffer.getvalue()


CLEAN_SITE: dict[str, str | bytes] = {
    "floor_dimensions.csv": "id,width,height\n1,60,32.5\n4,40,20\n",
    "floor_1/marker_dict.csv": "id,x,y\n10,1.5,2.5\n7,30,4\n",
    "floor_1/refmarker.csv": "1,2\n3.5,4\n",
    "floor_1/floorplan.jpg": plan_bytes("JPEG"),
    "floor_4/marker_dict.csv": "marker,x,y\n10,9,9\n7,1,1\n",
    "floor_4/floorplan.png": plan_bytes("PNG"),
}
CLEAN_SESSIONS = ("floor_1/LG/2022-01-14T16:35:30", "floor_1/One Plus/walk", "floor_4/LG/2022-01-14T16:35:30")


def write_survey(root: Path, changes: dict[str, str | bytes | None] | None = None) -> Path:
    """Write a clean survey of two floors; ``changes`` replace files (None: no such file)."""
    for name, content in (CLEAN_SITE | (changes or {})).items():
        if content is not None:
            path = root / name
            path.parent.mkdir(parents=True, exist_ok=True)
            path.write_bytes(content if isinstance(content, bytes) else content.encode())
    for folder in CLEAN_SESSIONS:
        write_session(root / folder, clean_files())
    return root
