"""``openapi.json`` of the studio, the source of the page's types.

Written by ``python -m vislam2tag.studio.openapi FILE``.
"""

from __future__ import annotations

import json
import re
import sys
from pathlib import Path
from typing import Any

from pydantic.json_schema import models_json_schema

import vislam2tag.studio.endpoints  # noqa: F401  (each adds itself to ENDPOINTS)
from vislam2tag.common.files.whole_output import write_file
from vislam2tag.common.records import FiniteRecord
from vislam2tag.studio.fleet import FleetView
from vislam2tag.studio.messages import NewLabels, Versions
from vislam2tag.studio.routing import ENDPOINTS, Endpoint
from vislam2tag.studio.work_messages import EnterRequest, Problem

_REFERENCE = "#/components/schemas/{model}"


_EVENTS: set[type[FiniteRecord]] = {NewLabels, Problem, Versions}
_OF_EXPORTS: set[type[FiniteRecord]] = {FleetView}
"""Records that only exported pages read."""
_FURTHER: set[type[FiniteRecord]] = {EnterRequest}


def openapi() -> dict[str, Any]:
    """The description of all endpoints with JSON input or output, and of the records in events."""
    given: set[type[FiniteRecord]] = {e.gives for e in ENDPOINTS if e.gives is not None}
    taken: set[type[FiniteRecord]] = {e.body for e in ENDPOINTS if e.body is not None}
    records = [
        *((record, "serialization") for record in sorted(given | _EVENTS | _OF_EXPORTS, key=_name)),
        *((record, "validation") for record in sorted(taken | _FURTHER, key=_name)),
    ]
    references, definitions = models_json_schema(records, ref_template=_REFERENCE)  # type: ignore[arg-type]
    paths: dict[str, dict[str, Any]] = {}
    for endpoint in ENDPOINTS:
        path = re.sub(r":short\}", "}", endpoint.path)
        paths.setdefault(path, {})[endpoint.method.lower()] = _operation(endpoint, references)
    paths["/api/enter"] = {
        "post": {
            "operationId": "post_enter",
            "requestBody": _content(references[EnterRequest, "validation"]),
            "responses": {"204": {"description": "entered"}},
        }
    }
    return {
        "openapi": "3.1.0",
        "info": {"title": "vislam2tag studio", "version": "1"},
        "paths": paths,
        "components": {"schemas": definitions["$defs"]},
    }


def _operation(endpoint: Endpoint, references: Any) -> dict[str, Any]:
    answer: dict[str, Any] = {"description": "the answer"}
    if endpoint.gives is not None:
        answer |= _content(references[endpoint.gives, "serialization"])
    words = re.sub(r"[^a-z]+", "_", endpoint.path.removeprefix("/api/").replace(":short", "")).strip("_")
    operation: dict[str, Any] = {
        "operationId": f"{endpoint.method.lower()}_{words}",
        "parameters": [*_path_parameters(endpoint.path), *_query_parameters(endpoint.query)],
        "responses": {
            str(endpoint.status): answer,
            "default": {"description": "refused"} | _content(references[Problem, "serialization"]),
        },
    }
    if endpoint.takes_file:
        operation["requestBody"] = {"required": True, "content": {"application/octet-stream": {}}}
    if endpoint.body is not None:
        operation["requestBody"] = {"required": True} | _content(references[endpoint.body, "validation"])
    return operation


def _content(schema: object) -> dict[str, Any]:
    return {"content": {"application/json": {"schema": schema}}}


def _path_parameters(path: str) -> list[dict[str, Any]]:
    return [
        {"name": name, "in": "path", "required": True, "schema": {"type": "integer" if kind else "string"}}
        for name, kind in re.findall(r"\{(\w+)(:short)?\}", path)
    ]


def _query_parameters(query: type[FiniteRecord]) -> list[dict[str, Any]]:
    schema = query.model_json_schema()
    required = schema.get("required", [])
    return [
        {"name": name, "in": "query", "required": name in required, "schema": part}
        for name, part in schema.get("properties", {}).items()
    ]


def _name(record: type[FiniteRecord]) -> str:
    return record.__name__


def main() -> None:
    """Write the description to the file of the command."""
    write_file(Path(sys.argv[1]), json.dumps(openapi(), indent=1, sort_keys=True) + "\n")


if __name__ == "__main__":
    main()
