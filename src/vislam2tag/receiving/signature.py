"""How phone and computer prove that they know the token without sending it (docs/phone-format.md, upload).

The token shown in the code is the key of an HMAC-SHA256 (RFC 2104) over all that a request or an answer means.
"""

from __future__ import annotations

import hashlib
import hmac
import re
from dataclasses import dataclass

SCHEME = "Vislam2tag"
"""Of the header ``Authorization``, followed by nonce and MAC."""
_PROTOCOL = "vislam2tag 2"
_SHOWN = re.compile(rf"{SCHEME} ([0-9a-f]{{32}}) ([0-9a-f]{{64}})", re.IGNORECASE)


@dataclass(frozen=True)
class SignedRequest:
    """What a request means: all that its MAC is over; ``offset`` and ``length`` are the headers, empty without."""

    method: str
    path: str
    offset: str
    length: str
    body_sha256: str
    nonce: str

    def mac(self, token: str) -> str:
        """The request's MAC, 64 lower-case hexadecimal digits."""
        parts = (self.method, self.path, self.offset, self.length, self.body_sha256, self.nonce)
        return _mac(token, "request", *parts)


def shown_mac(authorization: str) -> tuple[str, str] | None:
    """Nonce and MAC of the header ``Authorization``; None where it has another form."""
    match = _SHOWN.fullmatch(authorization)
    return (match.group(1).lower(), match.group(2).lower()) if match else None


def answer_mac(token: str, nonce: str, status: int, body: bytes) -> str:
    """MAC of an answer to the request with this nonce."""
    return _mac(token, "answer", nonce, str(status), hashlib.sha256(body).hexdigest())


def _mac(token: str, *parts: str) -> str:
    return hmac.new(token.encode(), "\n".join((_PROTOCOL, *parts)).encode(), hashlib.sha256).hexdigest()
