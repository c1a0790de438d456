"""Bodies of stubs: `throw new RuntimeException("Stub!")`, or one that answers nothing (JVMS 4.7.3, 6.5)."""

from __future__ import annotations

import struct

from apistubs.pool import Pool

_RETURN_NOTHING = b"\xb1"
_ZERO_AND_RETURN = {"J": b"\x09\xad", "F": b"\x0b\xae", "D": b"\x0e\xaf", "L": b"\x01\xb0", "[": b"\x01\xb0"}
_ZERO = {"J": b"\x09", "F": b"\x0b", "D": b"\x0e", "L": b"\x01", "[": b"\x01"}
_ZERO_INT = b"\x03"
_RETURN_INT = b"\xac"


def attribute(pool: Pool, name: str, content: bytes) -> bytes:
    """An attribute of a class, field or method."""
    return struct.pack(">HI", pool.utf8(name), len(content)) + content


def _code(pool: Pool, stack: int, arguments: int, instructions: bytes) -> bytes:
    head = struct.pack(">HHI", stack, arguments, len(instructions))
    return attribute(pool, "Code", head + instructions + struct.pack(">HH", 0, 0))


def throwing(pool: Pool, arguments: int) -> bytes:
    """Throws; `arguments` counts slots, the object's own too."""
    constructor = struct.pack(">H", pool.method("java/lang/RuntimeException", "<init>", "(Ljava/lang/String;)V"))
    made = b"\xbb" + struct.pack(">H", pool.class_("java/lang/RuntimeException"))
    message = b"\x59\x13" + struct.pack(">H", pool.string("Stub!"))
    return _code(pool, 3, arguments, made + message + b"\xb7" + constructor + b"\xbf")


def answering(pool: Pool, descriptor: str, arguments: int) -> bytes:
    """Returns 0, false, null or nothing."""
    returned = descriptor.rpartition(")")[2][0]
    nothing = _RETURN_NOTHING if returned == "V" else _ZERO_AND_RETURN.get(returned, _ZERO_INT + _RETURN_INT)
    return _code(pool, 2, arguments, nothing)


def constructing(pool: Pool, superclass: str, parameters: list[str], arguments: int) -> bytes:
    """Calls the superclass's constructor with zeros and nulls."""
    zeros = b"".join(_ZERO.get(descriptor[0], _ZERO_INT) for descriptor in parameters)
    call = struct.pack(">H", pool.method(superclass, "<init>", "(" + "".join(parameters) + ")V"))
    return _code(pool, 2 + 2 * len(parameters), arguments, b"\x2a" + zeros + b"\xb7" + call + _RETURN_NOTHING)
