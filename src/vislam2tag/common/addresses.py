"""The address that a server of ours listens on, and the code that shows it to phones; loads no web framework."""

from __future__ import annotations

import errno
import io
import socket

from vislam2tag.common.errors import UsageError

_ELSEWHERE = ("192.0.2.1", 9)
"""An address for documentation (RFC 5737): choosing a way there sends nothing."""
EVERYWHERE = ("0.0.0.0", "::", "")  # noqa: S104


def listen(host: str, port: int) -> socket.socket:
    """Open a socket to listen on; raises UsageError where that cannot be."""
    try:
        family = socket.getaddrinfo(host or None, port, type=socket.SOCK_STREAM, flags=socket.AI_PASSIVE)[0][0]
        return socket.create_server((host, port), family=family, backlog=64)
    except (OSError, UnicodeError) as error:
        if isinstance(error, OSError) and error.errno == errno.EADDRINUSE:
            raise UsageError(
                f"--port {port}: another program listens there already, perhaps one of ours; stop it, or use another "
                "port, or --port 0 for any free one"
            ) from error
        why = getattr(error, "strerror", None) or "it is not the name of a computer"
        raise UsageError(f"--host {host} --port {port}: cannot listen there: {why}") from error


def local_address() -> str:
    """This computer's address on the network that leads out of it; 127.0.0.1 where there is none."""
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as probe:
        try:
            probe.connect(_ELSEWHERE)
            return str(probe.getsockname()[0])
        except OSError:
            return "127.0.0.1"


def url_for(host: str, port: int, token: str) -> str:
    """Address for phones; the token is in the fragment, which browsers do not send."""
    address = local_address() if host in EVERYWHERE else host
    return f"http://{f'[{address}]' if ':' in address else address}:{port}/#{token}"


def code_of(text: str) -> str:
    """A QR code as lines of half blocks, for terminals."""
    import segno

    drawn = io.StringIO()
    segno.make(text, error="m", micro=False).terminal(drawn, compact=True)
    return drawn.getvalue()
