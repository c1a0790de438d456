"""Keys of cached work: besides its inputs and settings, its source code and libraries count.

The version of this program does not count: it stays the same while the source changes, and changes with pages.
"""

from __future__ import annotations

import ast
import hashlib
import importlib.util
import json
import platform
import re
import sys
import uuid
from collections.abc import Iterable, Iterator, Set
from dataclasses import dataclass
from functools import cache
from importlib.machinery import ModuleSpec, PathFinder
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path

from vislam2tag.common.files.given_files import read_bytes

SHOWING = frozenset({"vislam2tag.cli", "vislam2tag.views"})
"""Packages that only display results; changes to them do not invalidate results."""
DISTRIBUTIONS = {"PIL": "pillow", "cv2": "opencv-python-headless", "skimage": "scikit-image", "sklearn": "scikit-learn"}
"""Distributions of libraries with another import name."""
_IMPORT = re.compile(
    rb"(?:^|[;:])[ \t]*((?:import|from)[ \t.][^\n;(\\]*(?:\([^)]*\)|(?:\\\n[^\n]*)+)?)", flags=re.MULTILINE
)
"""Start of an import statement (or of a similar text)."""
_MODULE_NAME = re.compile(rb"""["']([A-Za-z_]\w*(?:\.[A-Za-z_]\w*)+)["']""")


def key_of(*parts: object) -> str:
    """SHA-256 of parts that JSON can represent."""
    return hashlib.sha256(json.dumps(parts, sort_keys=True).encode()).hexdigest()


def code_key(*entries: str) -> str:
    """SHA-256 of the source of some modules, of all modules that they can import, and of their libraries' versions.

    Imports inside functions count, and so do modules imported by a name in the source. They are followed within
    the packages of the entries, so that a plug-in counts with its own package; packages of :data:`SHOWING` are
    skipped. A module without a file (typed at a prompt) has a new key each time. A module is read once per process.
    """
    modules = _reachable(entries)
    sources = {name: module.sha256 if module else uuid.uuid4().hex for name, module in modules.items()}
    libraries = {_top(name) for module in modules.values() if module for name in module.imports}
    python = ".".join(platform.python_version_tuple()[:2])
    return key_of(sources, _versions(libraries - {_top(entry) for entry in entries}), python)


@dataclass(frozen=True)
class _Module:
    sha256: str
    imports: frozenset[str]
    """Names that may be modules: those of import statements, and texts that look like one."""


def _reachable(entries: Iterable[str]) -> dict[str, _Module | None]:
    """Modules by name, sorted: the entries and what they can import; None for an entry without a file."""
    entries = frozenset(entries)
    packages = {_top(entry) for entry in entries}
    found: dict[str, _Module | None] = {}
    seen: set[str] = set()
    waiting = set(entries)
    while waiting:
        name = waiting.pop()
        seen.add(name)
        module = None if name in SHOWING or _top(name) not in packages else _module(name)
        if module is not None or name in entries:
            found[name] = module
            waiting |= {*_parents(name), *(module.imports if module else ())} - seen
    return dict(sorted(found.items()))


def _top(name: str) -> str:
    return name.partition(".")[0]


def _parents(name: str) -> Iterator[str]:
    while "." in name:
        name = name.rpartition(".")[0]
        yield name


@cache
def _module(name: str) -> _Module | None:
    """Read a module; None if none of this name has a file."""
    spec = _spec(name)
    origin = getattr(sys.modules["__main__"], "__file__", None) if name == "__main__" else spec and spec.origin
    file = Path(origin or "")
    if not file.is_file():
        return None
    content = read_bytes(file)
    package = name if spec and spec.submodule_search_locations is not None else name.rpartition(".")[0]
    imports = frozenset(_imports(content, package)) if file.suffix == ".py" else frozenset[str]()
    return _Module(hashlib.sha256(content).hexdigest(), imports)


@cache
def _spec(name: str) -> ModuleSpec | None:
    """Find a module without importing it or its packages."""
    parent = name.rpartition(".")[0]
    if parent:
        package = None if parent in SHOWING else _spec(parent)
        places = package and package.submodule_search_locations
        return PathFinder.find_spec(name, places) if places else None
    try:
        return importlib.util.find_spec(name)
    except ValueError:  # it is loaded and came from no file
        return None


def _imports(content: bytes, package: str) -> Iterator[str]:
    """Names that may be modules; only statements that import are parsed, which takes a fifth of the time."""
    try:
        parsed = ast.parse(b"\n".join(_IMPORT.findall(content)))
    except SyntaxError:  # text that begins like an import, or a comment amid one
        parsed = ast.parse(content)
    for node in ast.walk(parsed):
        if isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names)
        elif isinstance(node, ast.ImportFrom):
            base = importlib.util.resolve_name("." * node.level + (node.module or ""), package)
            yield from (base, *(f"{base}.{alias.name}" for alias in node.names))
    yield from (name.decode() for name in _MODULE_NAME.findall(content))


def _versions(libraries: Set[str]) -> dict[str, str]:
    """Versions of those libraries that are installed; a library is named as it is imported."""
    return {name: found for name in sorted(libraries - sys.stdlib_module_names) if (found := _version(name))}


@cache
def _version(library: str) -> str | None:
    try:
        return version(DISTRIBUTIONS.get(library, library))
    except PackageNotFoundError:
        return None
