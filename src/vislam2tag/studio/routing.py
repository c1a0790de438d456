"""An endpoint of the studio: method and path, input and output, and the function that answers.

Routes and ``openapi.json`` are both generated from :data:`ENDPOINTS`.
"""

from __future__ import annotations

import inspect
import re
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any, TypeVar, get_type_hints

from pydantic import create_model

from vislam2tag.common.records import FiniteRecord

_Answering = TypeVar("_Answering", bound=Callable[..., "FiniteRecord | Binary"])


@dataclass(frozen=True)
class Binary:
    """An answer that is not JSON; ``version`` shows whether the browser has it already."""

    content: bytes
    media_type: str
    headers: dict[str, str] = field(default_factory=dict)
    version: str | None = None


@dataclass(frozen=True)
class Endpoint:
    """A method and path, and the function that answers, with annotations of input and output."""

    method: str
    path: str
    answer: Callable[..., FiniteRecord | Binary]
    """Arguments by name: parts of the studio (:data:`PARTS`), path parameters, ``body`` (a record), ``version`` (the
    header If-Match), ``content`` (a file in place of JSON), and query parameters, each alone or all as a record
    ``query``.
    """
    status: int
    query: type[FiniteRecord]
    """Record of the query parameters."""
    body: type[FiniteRecord] | None
    """Record of the JSON body."""
    gives: type[FiniteRecord] | None
    """Record of the answer; None: not JSON."""
    takes_file: bool
    """Whether the body is a file in place of JSON."""

    def answered(self, studio: object, query: FiniteRecord, asked: dict[str, object]) -> FiniteRecord | Binary:
        """Call the function with those arguments that it takes."""
        named = {**vars(studio), **asked, **dict(query), "query": query}
        names = inspect.signature(self.answer).parameters
        return self.answer(**{name: value for name, value in named.items() if name in names})


ENDPOINTS: list[Endpoint] = []
"""All endpoints, after ``endpoints`` is imported."""
PARTS = frozenset(("workspace", "jobs", "diagnoses", "events", "guard", "handover", "dropped", "worker", "command"))
"""Parts of the studio by name (:class:`.endpoints.Studio`)."""


def endpoint(method: str, path: str, status: int = 200) -> Callable[[_Answering], _Answering]:
    """Register a function for an address."""

    def register(function: _Answering) -> _Answering:
        kinds = get_type_hints(function, include_extras=True)
        gives = None if kinds["return"] is Binary else kinds["return"]
        query = kinds.get("query") or _query(path, function, kinds)
        ENDPOINTS.append(
            Endpoint(method, path, function, status, query, kinds.get("body"), gives, takes_file="content" in kinds)
        )
        return function

    return register


def _query(path: str, function: Callable[..., object], kinds: dict[str, Any]) -> type[FiniteRecord]:
    """Record of a function's parameters that come neither from the path nor from the request's body or headers."""
    others = {"body", "version", "content", *PARTS, *re.findall(r"\{(\w+)", path)}
    fields: dict[str, Any] = {
        one.name: (kinds[one.name], ... if one.default is one.empty else one.default)
        for one in inspect.signature(function).parameters.values()
        if one.name not in others
    }
    return create_model("Query", __base__=FiniteRecord, **fields)
