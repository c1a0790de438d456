"""Folders in object storage (``s3://``, ``az://``, ``gs://``; ``memory://`` in one process): a thin adapter to obstore.

Credentials, endpoint and region come from where each service's own tools look for them (environment, instance, web
identity); none is ever part of an address, a message or a result.
"""

from __future__ import annotations

import os
import re
import time
from collections import deque
from collections.abc import Callable, Iterable, Iterator, Mapping
from concurrent.futures import ThreadPoolExecutor, wait
from contextlib import contextmanager
from dataclasses import dataclass, field
from datetime import timedelta
from functools import cache
from itertools import islice
from pathlib import Path, PurePosixPath
from typing import IO, Any, TypeVar

from vislam2tag.common.errors import (
    StoreConflictError,
    StoreError,
    StoreUnansweredError,
    UsageError,
    first_line,
    import_extra,
)
from vislam2tag.common.files.folder import Folder, scratch_folder

SCHEMES = {"s3": "S3", "gs": "Google Cloud Storage", "az": "Azure Blob Storage", "memory": "memory"}
_ENDPOINTS = {
    "s3": ("AWS_ENDPOINT_URL", "AWS_ENDPOINT"),
    "gs": ("GOOGLE_BASE_URL",),
    "az": ("AZURE_STORAGE_ENDPOINT", "AZURE_ENDPOINT"),
}
"""Variables that name a server of one's own."""
_TIMEOUT_S = 60
"""Of one request; what is torn, refused for being too frequent (429, 503) or met a server's error is tried again."""
_RETRIES = {
    "max_retries": 8,
    "backoff": {"init_backoff": timedelta(milliseconds=100), "max_backoff": timedelta(seconds=10), "base": 2},
    "retry_timeout": timedelta(seconds=120),
}
_CAUSES = (
    (
        "NoSuchBucket|ContainerNotFound|bucket does not exist",
        "the bucket does not exist: create it, or correct its name",
    ),
    (
        "RequestTimeTooSkewed|clock",
        "the store rejects the request, because this machine's clock is wrong: set the clock",
    ),
    (
        "PermanentRedirect|HeaderMalformed|LocationConstraint|configured region",
        "the bucket is in another region: set AWS_REGION to that region",
    ),
    (
        "QuotaExceeded|InsufficientStorage|507 ",
        "the store has no space left for your account: free some, or ask for more",
    ),
    (
        "InvalidAccessKeyId|SignatureDoesNotMatch|InvalidAuthenticationInfo|failed to authenticate",
        "the credentials are wrong: check them",
    ),
    (
        "SlowDown|TooManyRequests|429 |503 ",
        "the store was too busy in all attempts: run again later, with fewer workers",
    ),
    (
        r"169\.254\.|/latest/|metadata\.google|credential",
        "no credentials were found: set them as you do for the service's own tools",
    ),
    (
        "401 |Unauthenticated",
        "the store does not know these credentials: set them as you do for the service's own tools",
    ),
    ("403 |AccessDenied|PermissionDenied", "permission is denied: the credentials must allow to list, read and write"),
)
"""By what the store answers: what it means and what to do; the first that matches counts."""


def obstore() -> Any:
    """The library, which belongs to the extra ``fleet``."""
    return import_extra("obstore")


@cache
def store_errors() -> tuple[type[Exception], ...]:
    """What it raises."""
    return (import_extra("obstore.exceptions").BaseError, OSError, ValueError)


@cache
def connection_to(address: str) -> Any:
    """Connect to a bucket once a process, whatever folders of it are asked for: each connection takes memory."""
    scheme = address.partition(":")[0]
    stores = import_extra("obstore.store")
    if scheme == "memory":
        return stores.MemoryStore()
    options: dict[str, Any] = {"timeout": timedelta(seconds=_TIMEOUT_S)}
    if any(os.environ.get(name, "").startswith("http://") for name in _ENDPOINTS[scheme]):
        options["allow_http"] = True  # a user who sets such an endpoint wants it
    try:
        return stores.from_url(address, client_options=options, retry_config=_RETRIES)
    except store_errors() as error:
        raise StoreError(f"{address}: cannot be opened as {SCHEMES[scheme]}: {cause_of(error)}") from None


def cause_of(error: Exception) -> str:
    """Say why, and what to do; addresses of requests, which may contain a signature, are left out."""
    text = str(error)
    for pattern, meaning in _CAUSES:
        if re.search(pattern, text.split("Debug source")[0], re.IGNORECASE):
            return meaning
    if "kind: Timeout" in text:
        return "the store did not answer in time in any attempt: check the network and the store's endpoint"
    line = re.sub(r"https?://\S+", "the store", first_line(error))
    return f"{line}; check the network, the address and the store's endpoint"


_ADDRESS = re.compile(rf"({'|'.join(SCHEMES)}):(?:/+(.*))?")
_AT_ONCE = 6
"""Requests of one process that a store is asked at the same time."""
PROBE = ".vislam2tag-probe-"
"""Prefix of the objects that test whether a store has conditional writes; they are removed after the test."""


def address_of(path: Path | str) -> str | None:
    """The address of a folder in a store that a path stands for; None for one of this machine.

    Where a path was made of an address it contains one slash of two, ``s3:/bucket/prefix``. Raises UsageError for an
    address with credentials or without a bucket.
    """
    match = _ADDRESS.fullmatch(os.fspath(path))
    if match is None:
        return None
    scheme, rest = match.groups(default="")
    if "@" in rest.partition("/")[0]:
        raise UsageError(f"{scheme}://...: credentials must not be part of an address: set them in the environment")
    if not rest:
        raise UsageError(f"{scheme}://: names no bucket; use {scheme}://BUCKET/FOLDER")
    return f"{scheme}://{rest.rstrip('/')}"


def shown(path: Path | str) -> str:
    """A path, or the address that it stands for, as people write it; other text stays as it is."""
    return address_of(path) or str(path)


_UNANSWERED = re.compile("kind: (Timeout|Interrupted)")
"""In what obstore says of a request that was sent, and and it is unknown whether it was done."""
_WAITS_S = (0.1, 0.3, 1.0, 3.0)
"""Before each further try of a conditional write that was not answered, which obstore itself does not repeat."""


@dataclass(frozen=True)
class Version:
    """One version of an object, for conditional writes."""

    e_tag: str | None
    number: str | None = None

    @property
    def mark(self) -> str:
        """Identifies this version of the object."""
        return self.number or self.e_tag or ""


@dataclass(frozen=True)
class Stored:
    """An object that was read."""

    data: bytes
    version: Version
    notes: Mapping[str, str]
    """What was stored with it by the program that put it."""


@dataclass(frozen=True, order=True)
class Listed:
    """An object as a listing shows it."""

    name: str
    """Path below the folder that was listed."""
    size: int
    version: Version = field(compare=False)


_Asked = TypeVar("_Asked")
_Answer = TypeVar("_Answer")


@cache
def asking() -> ThreadPoolExecutor:
    """The threads in which this process asks stores; what they do must not wait for another of them."""
    return ThreadPoolExecutor(_AT_ONCE, thread_name_prefix="store")


def at_once(ask: Callable[[_Asked], _Answer], about: Iterable[_Asked]) -> Iterator[_Answer]:
    """Ask a store about several things, a few at a time, as each answer takes a while; yield answers in their order.

    No more than a few answers wait to be taken. Raises what asking raises; nothing is asked any more then.
    """
    rest, pool = iter(about), asking()
    waiting = deque(pool.submit(ask, each) for each in islice(rest, _AT_ONCE))
    try:
        while waiting:
            answer = waiting.popleft().result()
            waiting.extend(pool.submit(ask, each) for each in islice(rest, 1))
            yield answer
    finally:
        wait([future for future in waiting if not future.cancel()])


@dataclass(frozen=True)
class Store:
    """A folder in a store; names are paths below it. Cheap to pass to other processes, which connect on their own.

    Every method raises StoreError, with one clear message, where the store does not do what is asked.
    """

    address: str

    @property
    def _bucket(self) -> Any:
        return connection_to(_split(self.address)[0])

    def _path(self, name: str) -> str:
        """The name of an object in the bucket."""
        return "/".join(part for part in (_split(self.address)[1], name) if part)

    def _name(self, path: str) -> str:
        """What an object of the bucket is called below the folder."""
        prefix = _split(self.address)[1]
        return path[len(prefix) + 1 :] if prefix else path

    def get(self, name: str) -> Stored | None:
        """Read an object whole; None where there is none."""

        def read(path: str) -> Stored:
            found = obstore().get(self._bucket, path)
            notes = {str(key): str(value) for key, value in found.attributes.items()}
            return Stored(bytes(found.bytes()), _version(found.meta), notes)

        return self._found(name, read)

    def fetch(self, name: str, folder: Folder, new_name: str) -> Version | None:
        """Stream an object into a file of a folder; None, and no file, if there is none."""

        def stream(path: str) -> Version:
            found = obstore().get(self._bucket, path)
            with folder.writing(new_name) as file:
                for chunk in found.stream():
                    file.write(chunk)
            return _version(found.meta)

        return self._found(name, stream)

    @contextmanager
    def opened(self, name: str) -> Iterator[IO[bytes]]:
        """Yield an object as a file, of which only what is read is fetched."""
        try:
            yield obstore().open_reader(self._bucket, self._path(name))
        except store_errors() as error:
            raise self._error(name, "read", error) from None

    def version(self, name: str) -> Version | None:
        """Version of an object that is there; None where there is none."""
        return self._found(name, lambda path: _version(obstore().head(self._bucket, path)))

    def put(self, name: str, content: bytes | Path, notes: Mapping[str, str] | None = None) -> Version:
        """Write an object whole, in one request or, where it is large, in parts; whatever was there is replaced."""
        return self._put(name, content, notes, None)

    @contextmanager
    def filling(self, name: str) -> Iterator[Path]:
        """Yield where a library may write a file of this machine, which is put when the block ends well."""
        with scratch_folder() as scratch:
            path = scratch / PurePosixPath(name).name
            yield path
            self.put(name, path)

    def put_over(
        self, name: str, content: bytes, before: Version | None, notes: Mapping[str, str] | None = None
    ) -> Version:
        """Replace the version ``before`` of an object, or create it where that is None.

        Where another version is there that contains just this, it is taken for that of a try whose answer was lost.
        Raises StoreConflictError where it contains something else.
        """
        there_now = {} if before is None else {"e_tag": before.e_tag, "version": before.number}
        mode = {key: value for key, value in there_now.items() if value is not None} or "create"
        waits_s = iter(_WAITS_S)
        while True:
            try:
                return self._put(name, content, notes, mode)
            except StoreConflictError:
                there = self.get(name)
                if there is None or there.data != content or not (notes or {}).items() <= there.notes.items():
                    raise
                return there.version
            except StoreUnansweredError:
                wait_s = next(waits_s, None)
                if wait_s is None:
                    raise
                time.sleep(wait_s)

    def _put(self, name: str, content: bytes | Path, notes: Mapping[str, str] | None, mode: Any) -> Version:
        options = {} if mode is None else {"mode": mode, "use_multipart": False}
        try:
            path = self._path(name)
            return _version(obstore().put(self._bucket, path, content, attributes=dict(notes or {}), **options))
        except store_errors() as error:
            if type(error).__name__ in ("AlreadyExistsError", "PreconditionError"):
                raise StoreConflictError(
                    f"{self.address}/{name}: another program wrote it during this run; run the same command again"
                ) from None
            raise self._error(name, "written", error) from None

    def list(self, folder: str = "") -> Iterator[Listed]:
        """List all objects below a folder, a page at a time."""
        try:
            for page in obstore().list(self._bucket, self._path(folder) or None):
                for each in page:
                    yield Listed(self._name(each["path"]), each["size"], _version(each))
        except store_errors() as error:
            raise self._error(folder, "listed", error) from None

    def folders(self) -> tuple[str, ...]:
        """Names of the folders right below, sorted; hidden ones are left out."""
        try:
            found = obstore().list_with_delimiter(self._bucket, self._path("") or None)["common_prefixes"]
        except store_errors() as error:
            raise self._error("", "listed", error) from None
        return tuple(sorted(name for name in map(self._name, found) if not name.startswith(".")))

    def delete(self, names: Iterable[str]) -> None:
        """Remove objects; one that is not there is no fault."""
        wanted = list(names)
        try:
            if wanted:
                obstore().delete(self._bucket, [self._path(name) for name in wanted])
        except FileNotFoundError:
            return
        except store_errors() as error:
            raise self._error(wanted[0], "removed", error) from None

    def refuse_without_conditional_writes(self) -> None:
        """Raise StoreError where two programs could both create one object: then nothing here would be safe."""
        probe = f"{PROBE}{os.urandom(8).hex()}"
        first = self.put_over(probe, b"first", None)
        try:
            for before in (None, Version('"another"', None if first.number is None else "1")):
                try:
                    self.put_over(probe, b"second", before)
                except StoreConflictError:
                    continue
                raise StoreError(
                    f"{self.address}: the store has no conditional writes (a second program's object took the place of "
                    "the first one's), so that two workers could spoil each other's results; choose another store"
                )
        finally:
            self.delete([probe])

    def _error(self, name: str, what: str, error: Exception) -> StoreError:
        kind = StoreUnansweredError if _UNANSWERED.search(str(error)) else StoreError
        return kind(f"{f'{self.address}/{name}'.rstrip('/')}: cannot be {what}: {cause_of(error)}")

    def _found(self, name: str, ask: Callable[[str], _Answer]) -> _Answer | None:
        """What asking about an object, by its path in the bucket, returns; None if there is none."""
        try:
            return ask(self._path(name))
        except FileNotFoundError as error:
            if "NoSuchBucket" in str(error) or "ContainerNotFound" in str(error):
                raise self._error("", "read", error) from None
            return None
        except store_errors() as error:
            raise self._error(name, "read", error) from None


def store_at(path: Path) -> Store | None:
    """The folder in a store that a path stands for; None for one of this machine."""
    address = address_of(path)
    return None if address is None else Store(address)


def _split(address: str) -> tuple[str, str]:
    """The address of the bucket, and the folder's path in it."""
    scheme, _, rest = address.partition("://")
    bucket, _, prefix = rest.partition("/")
    return f"{scheme}://{bucket}", prefix.strip("/")


def _version(meta: Mapping[str, Any]) -> Version:
    return Version(meta.get("e_tag"), meta.get("version"))
