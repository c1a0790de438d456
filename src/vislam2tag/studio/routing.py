"""An endpoint of the studio: method and path, what it takes and gives, and the function that answers.

Routes and ``openapi.json`` are both made of :data:`ENDPOINTS`.
"""

from __future__ import annotations

import inspect
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any, TypeVar, get_type_hints

from vislam2tag.common.records import FiniteRecord
from vislam2tag.studio.messages import NoQuery

_Answering = TypeVar("_Answering", bound=Callable[..., "FiniteRecord | Binary"])


@dataclass(frozen=True)
class Binary:
    """An answer that is no JSON; ``version`` tells whether the browser has it already."""

    content: bytes
    media_type: str
    headers: dict[str, str] = field(default_factory=dict)
    version: str | None = None


@dataclass(frozen=True)
class Endpoint:
    """A method and path, and the function that answers, whose annotations say what it takes and gives."""

    method: str
    path: str
    answer: Callable[..., FiniteRecord | Binary]
    """Takes the studio, and by name: what stands in the path, ``query`` and ``body`` as records, ``version`` (the
    header If-Match), ``content`` (a file in place of JSON).
    """
    status: int
    kinds: dict[str, Any]

    @property
    def query(self) -> type[FiniteRecord]:
        """Record of what stands behind the question mark."""
        query: type[FiniteRecord] = self.kinds.get("query", NoQuery)
        return query

    @property
    def body(self) -> type[FiniteRecord]:
        """Record of its JSON."""
        body: type[FiniteRecord] = self.kinds.get("body", NoQuery)
        return body

    @property
    def gives(self) -> type[FiniteRecord] | None:
        """Record of the answer; None: no JSON."""
        return None if self.kinds["return"] is Binary else self.kinds["return"]

    @property
    def takes_file(self) -> bool:
        """Whether the body is a file in place of JSON."""
        return "content" in self.kinds

    def answered(self, studio: object, asked: dict[str, object]) -> FiniteRecord | Binary:
        """Answer with those of the things asked by name that the function takes."""
        names = inspect.signature(self.answer).parameters
        return self.answer(studio, **{name: value for name, value in asked.items() if name in names})


ENDPOINTS: list[Endpoint] = []
"""All that can be asked, once ``endpoints`` is imported."""


def endpoint(method: str, path: str, status: int = 200) -> Callable[[_Answering], _Answering]:
    """Let a function answer at an address."""

    def register(function: _Answering) -> _Answering:
        ENDPOINTS.append(Endpoint(method, path, function, status, get_type_hints(function)))
        return function

    return register
