"""Requests as phones sign them."""

from __future__ import annotations

import hashlib
import secrets

from vislam2tag.studio.receiving.server import BODY_SHA256, UPLOADS
from vislam2tag.studio.receiving.token import SCHEME, SignedRequest


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
