"""Connections to buckets by obstore, and what it means that one fails.

Credentials, endpoint and region come from where each service's own tools look for them (environment, instance, web
identity); none is ever part of a message.
"""

from __future__ import annotations

import os
import re
from datetime import timedelta
from functools import cache
from typing import Any

from vislam2tag.common.errors import StoreError, first_line
from vislam2tag.common.extras import import_extra

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
    ("NoSuchBucket|ContainerNotFound|bucket does not exist", "there is no such bucket: make it, or correct its name"),
    ("RequestTimeTooSkewed|clock", "this machine's clock is wrong, which the store refuses: set it"),
    (
        "PermanentRedirect|HeaderMalformed|LocationConstraint|configured region",
        "the bucket lies in another region: set AWS_REGION to its own",
    ),
    ("QuotaExceeded|InsufficientStorage|507 ", "the store has no space left for you: free some or ask for more"),
    (
        "InvalidAccessKeyId|SignatureDoesNotMatch|InvalidAuthenticationInfo|failed to authenticate",
        "the credentials are wrong: check them",
    ),
    ("SlowDown|TooManyRequests|429 |503 ", "the store is too busy, in all tries: run again later, with fewer workers"),
    (
        r"169\.254\.|/latest/|metadata\.google|credential",
        "no credentials were found: set them as for the service's own tools",
    ),
    ("401 |Unauthenticated", "no credentials that the store knows: set them as for the service's own tools"),
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
        options["allow_http"] = True  # whoever names such an endpoint wants it
    try:
        return stores.from_url(address, client_options=options, retry_config=_RETRIES)
    except store_errors() as error:
        raise StoreError(f"{address}: cannot be opened as {SCHEMES[scheme]}: {cause_of(error)}") from None


def cause_of(error: Exception) -> str:
    """Say why, and what to do; addresses of requests, which may hold a signature, are left out."""
    text = str(error)
    for pattern, meaning in _CAUSES:
        if re.search(pattern, text.split("Debug source")[0], re.IGNORECASE):
            return meaning
    if "kind: Timeout" in text:
        return "the store does not answer in time, in all tries: check the network and the store's endpoint"
    line = re.sub(r"https?://\S+", "the store", first_line(error))
    return f"{line}; check the network, the address and the store's endpoint"
