"""Zips of sessions, and signed requests that bring them."""

from __future__ import annotations

import hashlib
import io
import json
import secrets
import zipfile
from collections.abc import Mapping
from typing import Any

from vislam2tag.studio.receiving.server import BODY_SHA256, UPLOADS
from vislam2tag.studio.receiving.token import SCHEME, SignedRequest

SESSION = "2021-12-20T132523"
HEADER = b"time_ns,n,action\n"


def record(**changes: object) -> bytes:
    content = {
        "format": "vislam2tag-phone",
        "version": 1,
        "session": SESSION,
        "site": "",
        "floor": 4,
        "device": "LG",
        "note": "",
        "app": {},
        "phone": {},
        "start": {},
        "end": {"state": "stopped"},
    }
    return json.dumps(content | changes).encode()


def session_files(**changes: object) -> dict[str, bytes]:
    return {
        "session.json": record(**changes),
        "ControlPoint.csv": HEADER,
        "CameraPose.csv": b"time_ns\n" + b"1\n" * 500,
    }


def sums(files: Mapping[str, bytes]) -> bytes:
    return "".join(f"{hashlib.sha256(files[name]).hexdigest()}  {name}\n" for name in sorted(files)).encode()


def packed(entries: Mapping[Any, bytes], method: int = zipfile.ZIP_DEFLATED) -> bytes:
    """A zip with these entries, by name or ZipInfo, whatever their names."""
    buffer = io.BytesIO()
    with zipfile.ZipFile(buffer, "w", method) as archive:
        for name, content in entries.items():
            info = name if isinstance(name, zipfile.ZipInfo) else zipfile.ZipInfo(name, (1980, 2, 1, 0, 0, 0))
            archive.writestr(info, content, method)
    return buffer.getvalue()


def session_zip(files: Mapping[str, bytes] | None = None, folder: str = SESSION, **more: bytes) -> bytes:
    """A session's zip with right checksums; ``more`` replaces files after they were summed."""
    chosen = dict(files if files is not None else session_files())
    chosen["SHA256SUMS"] = sums(chosen)
    chosen |= {name.replace("_csv", ".csv"): content for name, content in more.items()}
    return packed({f"{folder}/{name}": chosen[name] for name in sorted(chosen)})


def digest(data: bytes) -> str:
    return hashlib.sha256(data).hexdigest()


def signed(
    token: str, method: str, name: str, body: bytes = b"", offset: int | str = "", length: int | str = ""
) -> dict[str, str]:
    """Headers of a request for an upload that prove the token."""
    return signed_path(token, method, f"{UPLOADS}/{name}", body, offset, length)


def signed_path(
    token: str, method: str, path: str, body: bytes = b"", offset: int | str = "", length: int | str = ""
) -> dict[str, str]:
    """Headers of a request for any address that prove the token."""
    body_sha256 = hashlib.sha256(body).hexdigest()
    nonce = secrets.token_hex(16)
    request = SignedRequest(method, path, str(offset), str(length), body_sha256, nonce)
    headers = {"Authorization": f"{SCHEME} {nonce} {request.mac(token)}", BODY_SHA256: body_sha256}
    told = {"Upload-Offset": str(offset), "Upload-Length": str(length)} if method == "PATCH" else {}
    return headers | told
