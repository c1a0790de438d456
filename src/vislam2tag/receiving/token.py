"""The token that lets a phone hand over sessions, how both prove that they know it, and the guard who asks for it.

The token is never sent (docs/reference/phone-handover.md): shown in the code, it is the key of an HMAC-SHA256
(RFC 2104) over all that a request or an answer means.
"""

from __future__ import annotations

import hashlib
import hmac
import re
import secrets
from collections import OrderedDict
from collections.abc import Callable
from dataclasses import dataclass, field
from math import ceil

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


def authorization_mac(authorization: str) -> tuple[str, str] | None:
    """Nonce and MAC of the header ``Authorization``; None where it has another form."""
    match = _SHOWN.fullmatch(authorization)
    return (match.group(1).lower(), match.group(2).lower()) if match else None


def answer_mac(token: str, nonce: str, status: int, body: bytes) -> str:
    """MAC of an answer to the request with this nonce."""
    return _mac(token, "answer", nonce, str(status), hashlib.sha256(body).hexdigest())


def _mac(token: str, *parts: str) -> str:
    return hmac.new(token.encode(), "\n".join((_PROTOCOL, *parts)).encode(), hashlib.sha256).hexdigest()


ALPHABET = "ABCDEFGHIJKLMNOPQRSTUVWXYZ234567"
LENGTH = 16
"""80 bits: too many to guess, few enough to type."""
WRONG_ALLOWED = 5
"""So many requests of an address may prove nothing before it must wait ..."""
WAIT_S = 60.0
"""... this long."""
ADDRESSES = 1000
"""Addresses remembered; the one longest silent is forgotten."""


def new_token() -> str:
    """Draw a token from the operating system's source."""
    return "".join(secrets.choice(ALPHABET) for _ in range(LENGTH))


def grouped(token: str) -> str:
    """A token in groups of four, for people to read."""
    return "-".join(token[start : start + 4] for start in range(0, len(token), 4))


@dataclass
class _Wrong:
    count: int = 0
    until_s: float = 0.0


@dataclass
class Guard:
    """Checks who knows the token, and lets addresses wait that did not too often; ``clock`` gives seconds."""

    token: str
    clock: Callable[[], float]
    _wrong: OrderedDict[str, _Wrong] = field(default_factory=OrderedDict)

    def waiting_s(self, address: str) -> int:
        """Whole seconds that an address must wait; 0 where it may ask."""
        known = self._wrong.get(address)
        return max(0, ceil(known.until_s - self.clock())) if known else 0

    def admits(self, address: str, request: SignedRequest, mac: str) -> bool:
        """Tell whether a request's MAC is right; a wrong one counts against the address."""
        if hmac.compare_digest(mac, request.mac(self.token)):
            self._wrong.pop(address, None)
            return True
        self.refuse(address)
        return False

    def refuse(self, address: str) -> None:
        """Count a request without a right MAC against its address."""
        known = self._wrong.pop(address, _Wrong())
        known.count += 1
        if known.count >= WRONG_ALLOWED:
            known.count, known.until_s = 0, self.clock() + WAIT_S
        self._wrong[address] = known
        while len(self._wrong) > ADDRESSES:
            self._wrong.popitem(last=False)
