"""The token for sending sessions from a phone, and the proofs that phone and computer know it.

The token is never sent (docs/reference/phone-handover.md). It is shown in the code, and is the key of an HMAC-SHA256
(RFC 2104) over the content of requests and answers.
"""

from __future__ import annotations

import hashlib
import hmac
import re
import secrets
from dataclasses import dataclass, field

SCHEME = "Vislam2tag"
"""Of the header ``Authorization``, followed by nonce and MAC."""
_PROTOCOL = "vislam2tag 2"
_SHOWN = re.compile(rf"{SCHEME} ([0-9a-f]{{32}}) ([0-9a-f]{{64}})", re.IGNORECASE)


@dataclass(frozen=True)
class SignedRequest:
    """The content of a request for its MAC; ``offset`` and ``length`` are headers, or empty."""

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


def authorization_mac(authorization: str) -> tuple[str, str] | None:
    """Nonce and MAC of the header ``Authorization``; None if it has another form."""
    match = _SHOWN.fullmatch(authorization)
    return (match.group(1).lower(), match.group(2).lower()) if match else None


def answer_mac(token: str, nonce: str, status: int, body: bytes) -> str:
    """MAC of an answer to the request with this nonce."""
    return _mac(token, "answer", nonce, str(status), hashlib.sha256(body).hexdigest())


def _mac(token: str, *parts: str) -> str:
    return hmac.new(token.encode(), "\n".join((_PROTOCOL, *parts)).encode(), hashlib.sha256).hexdigest()


WRONG_PROOF = "the token is missing or wrong; scan the code again"
ALPHABET = "ABCDEFGHIJKLMNOPQRSTUVWXYZ234567"
LENGTH = 16
"""80 bits are too many to guess, and few enough to type. So wrong proofs need no penalty."""
MAX_REQUESTS = 1_000_000
"""Maximum number of proven requests of a token; each nonce is stored as long as the token is valid."""


def new_token() -> str:
    """Draw a token from the operating system's source."""
    return "".join(secrets.choice(ALPHABET) for _ in range(LENGTH))


def grouped(token: str) -> str:
    """A token in groups of four, for people to read."""
    return "-".join(token[start : start + 4] for start in range(0, len(token), 4))


@dataclass
class Guard:
    """Checks that senders know the token, and that each number (nonce) is used once."""

    token: str
    max_requests: int = MAX_REQUESTS
    _used: set[bytes] = field(default_factory=set)

    def refusal(self, request: SignedRequest, mac: str) -> str | None:
        """Why a request is refused; None if its MAC is right and its nonce is new, which is then used up."""
        if not hmac.compare_digest(mac, request.mac(self.token)):
            return WRONG_PROOF
        number = bytes.fromhex(request.nonce)
        if number in self._used:
            return "this request was sent before; send it again with a new number"
        if len(self._used) >= self.max_requests:
            return (
                f"the token is used up after {self.max_requests:,} requests; stop receiving, start it again and scan "
                "the new code"
            )
        self._used.add(number)
        return None
