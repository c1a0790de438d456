"""Hosts of their own for tests: network namespaces on one bridge, each with its own name and temporary folder."""

from __future__ import annotations

import os
import subprocess
import tempfile
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

import psutil
import pytest

from tests.stores import wait_for

SSH_PORT = 22
SSH_SERVER = Path("/usr/sbin/sshd")
_OWN_FILES = 'hostname "$0" && mount -t tmpfs none "$TMPDIR" && mkdir -p /run/sshd && cd "$TMPDIR" && exec "$@"'


@dataclass(frozen=True)
class Host:
    """One namespace."""

    name: str
    namespace: str
    address: str
    temporary: Path
    started: list[subprocess.Popen[bytes]]

    def start(self, *command: str | Path, **environment: str) -> subprocess.Popen[bytes]:
        """Start a program there; it ends with the hosts."""
        inside = ("ip", "netns", "exec", self.namespace, "unshare", "--mount", "--uts", "sh", "-c", _OWN_FILES)
        process = subprocess.Popen(
            [*inside, self.name, *command], env={**os.environ, "TMPDIR": str(self.temporary), **environment}
        )
        self.started.append(process)
        return process


@contextmanager
def network_hosts(hidden: Path, *names: str) -> Iterator[tuple[str, list[Host]]]:
    """Make hosts that reach each other and, at the address that comes first, this process; skips without the right.

    No host sees what others have in the folder ``hidden``: there, each has a temporary folder of its own.
    """
    number = os.getpid()
    bridge, net = f"v2t{number}", f"198.18.{number // 32 % 256}"
    first = number % 32 * 8
    hosts = [Host(name, f"{bridge}{name}", f"{net}.{first + 2 + i}", hidden, []) for i, name in enumerate(names)]
    try:
        _make(bridge, f"{net}.{first + 1}", hosts)
        yield f"{net}.{first + 1}", hosts
    finally:
        for process in (process for host in hosts for process in host.started):
            _end(process)
        for host in hosts:
            subprocess.run(["ip", "netns", "del", host.namespace], check=False, stderr=subprocess.DEVNULL)
        subprocess.run(["ip", "link", "del", bridge], check=False, stderr=subprocess.DEVNULL)


def _make(bridge: str, address: str, hosts: Sequence[Host]) -> None:
    try:
        _ip("link", "add", bridge, "type", "bridge")
        _ip("address", "add", f"{address}/29", "dev", bridge)
        _ip("link", "set", bridge, "up")
        for i, host in enumerate(hosts):
            _ip("netns", "add", host.namespace)
            _ip("link", "add", f"{bridge}{i}", "type", "veth", "peer", "eth0", "netns", host.namespace)
            _ip("link", "set", f"{bridge}{i}", "master", bridge, "up")
            _ip("-n", host.namespace, "address", "add", f"{host.address}/29", "dev", "eth0")
            _ip("-n", host.namespace, "link", "set", "eth0", "up")
            _ip("-n", host.namespace, "link", "set", "lo", "up")
            # Programs find their own address by the way to elsewhere; nothing is forwarded there.
            _ip("-n", host.namespace, "route", "add", "default", "via", address)
    except (OSError, subprocess.CalledProcessError) as error:
        pytest.skip(f"no network namespaces can be made here: {error}")


def _ip(*arguments: str) -> None:
    subprocess.run(["ip", *arguments], check=True, stderr=subprocess.DEVNULL)


def _end(process: subprocess.Popen[bytes]) -> None:
    try:
        family = psutil.Process(process.pid).children(recursive=True)
    except psutil.NoSuchProcess:
        family = []
    process.kill()
    process.wait()
    for child in family:
        if child.is_running():
            child.kill()


@contextmanager
def ssh_servers(hosts: Sequence[Host], environment: dict[str, str]) -> Iterator[dict[str, str]]:
    """Start an SSH server on each host that gives its sessions the environment; yield options for a client."""
    environment = {**environment, "TMPDIR": str(hosts[0].temporary)}
    with tempfile.TemporaryDirectory(dir="/var/tmp") as place:  # all hosts see it, as keys that each was given
        keys = Path(place)
        for name in ("host", "client"):
            subprocess.run(["ssh-keygen", "-q", "-t", "ed25519", "-N", "", "-f", keys / name], check=True)
        public = (keys / "host.pub").read_text()
        (keys / "known_hosts").write_text("".join(f"{host.address} {public}" for host in hosts))
        given = " ".join(f'{name}="{value}"' for name, value in environment.items())
        (keys / "sshd_config").write_text(
            f"Port {SSH_PORT}\nHostKey {keys / 'host'}\nAuthorizedKeysFile {keys / 'client.pub'}\nStrictModes no\n"
            f"UsePAM no\nPidFile none\nSetEnv {given}\n"
        )
        for host in hosts:
            wait_for(host.address, SSH_PORT, host.start(SSH_SERVER, "-D", "-e", "-q", "-f", keys / "sshd_config"))
        yield {"known_hosts": str(keys / "known_hosts"), "client_keys": str(keys / "client"), "username": "root"}
