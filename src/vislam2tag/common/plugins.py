"""What is found by name: built-in modules of one folder, and modules of other installed packages (entry points).

Either kind of module ends with a call that adds what it contains to its :class:`Registry`. A built-in module has the
name of what it adds, ``dead_reckoning.py`` for ``dead-reckoning`` (and ``global_.py``, since ``global`` is a keyword),
or its kind says what it adds. An entry point has the name of what its module adds. So names are known before anything
is imported.
"""

from __future__ import annotations

import hashlib
import importlib
import logging
import multiprocessing
import pkgutil
import sys
import traceback
from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cached_property
from importlib.metadata import EntryPoint, entry_points
from importlib.util import find_spec, module_from_spec, spec_from_file_location
from pathlib import Path
from types import MappingProxyType, ModuleType
from typing import Any, Generic, TypeVar

from vislam2tag.common.errors import UsageError, first_line
from vislam2tag.common.files.given_files import read_bytes

Item = TypeVar("Item")
_FOREIGN: dict[Path, str] = {}
"""What installed packages offer, by the folders or files of their code."""
_log = logging.getLogger("vislam2tag-plugins")  # not below "vislam2tag", whose records go to the log of an output


@dataclass(frozen=True)
class Kind:
    """A kind of things that can be added, and where its modules are."""

    words: str
    """To end a sentence: "mapping strategy"."""
    group: str
    """Of entry points."""
    package: str
    """That the built-in modules lie in, by its full name."""
    shared: Mapping[str, tuple[str, ...]] = field(default_factory=dict)
    """What a module adds, by the module's name, if that is not one thing called like the module."""
    of_files: bool = False
    """Whether ``NAME.py:CLASS`` names one of a user's file."""

    @cached_property
    def built_in(self) -> dict[str, str]:
        """Full names of the built-in modules by what they add."""
        top, *below = self.package.split(".")
        spec = find_spec(top)  # the packages below would be imported to be found
        folders = [str(Path(folder, *below)) for folder in (spec and spec.submodule_search_locations) or ()]
        modules = [module.name for module in pkgutil.iter_modules(folders)]
        return {
            name: f"{self.package}.{module}"
            for module in modules
            for name in self.shared.get(module, (module.rstrip("_").replace("_", "-"),))
        }

    @cached_property
    def installed(self) -> dict[str, EntryPoint]:
        """Entry points by name; of one name the first counts, in the order of the packages' names."""
        found: dict[str, EntryPoint] = {}
        for entry in sorted(entry_points(group=self.group), key=_package_of):
            if entry.name in self.built_in or entry.name in found:
                owner = f"the package {_package_of(found[entry.name])}" if entry.name in found else "vislam2tag itself"
                _warn(
                    f"the {self.words} '{entry.name}' of the package {_package_of(entry)} is skipped, because {owner} "
                    "has the same name"
                )
            else:
                found[entry.name] = entry
        return found

    def names(self) -> tuple[str, ...]:
        """Names of all there are, sorted; nothing is imported for it."""
        return tuple(sorted({*self.built_in, *self.installed}))


STRATEGIES = Kind(
    "mapping strategy",
    "vislam2tag.strategies",
    "vislam2tag.estimation.strategies",
    of_files=True,
    shared={"global_": ("global", "global-affine"), "local": ("local", "local-corrected")},
)
SESSION_FORMATS = Kind(
    "session format",
    "vislam2tag.session_formats",
    "vislam2tag.sessions.formats",
    shared={
        "scanner_apps": ("arkit-data-logger", "ios-logger", "polycam", "record3d", "scanner-3d-app", "stray-scanner"),
        "any_tracker": ("mcap", "tum"),
    },
)
PLAN_FORMATS = Kind("plan format", "vislam2tag.plan_formats", "vislam2tag.site.plan_formats")
DATASET_FORMATS = Kind(
    "data set format",
    "vislam2tag.dataset_formats",
    "vislam2tag.datasets.formats",
    shared={
        "csv_tables": ("csv",),
        "geo_tables": ("geopackage", "geoparquet"),
        "posed_pictures": ("colmap", "kapture", "lamar"),
        "published_sets": (
            *("dungeon-assistant", "sodindoorloc", "tampere", "trn-tst", "tuji1", "uji-library", "uts", "wifine"),
        ),
    },
)
MODELS = Kind("positioning model", "vislam2tag.models", "vislam2tag.positioning.models")
STUDIO_LAYERS = Kind(
    "layer of the studio",
    "vislam2tag.studio_layers",
    "vislam2tag.studio.layers",
    shared={"contradictions": ("conflicts", "contradictions"), "walkable": ("gaps", "walkable")},
)


class _UnusablePluginError(UsageError):
    """What an installed package offers cannot be used."""


class Registry(Generic[Item]):
    """What there is of one kind, by name; only what is asked for is imported."""

    def __init__(self, kind: Kind) -> None:
        """Take its kind; its items come when their modules are imported."""
        self._kind = kind
        self._items: dict[str, Item] = {}
        self._unusable: dict[str, _UnusablePluginError] = {}
        self._here = set[str]()

    def add(self, name: str, item: Item) -> None:
        """Make something known by name; called at the end of its module. Raises UsageError for a name that is taken."""
        built_in = self._kind.built_in.get(name)
        if name in self._items or (built_in is not None and built_in not in sys.modules):
            raise UsageError(f"there already is a {self._kind.words} '{name}'; choose another name")
        self._items[name] = item

    def names(self) -> tuple[str, ...]:
        """Names of all there are, sorted; nothing is imported for it."""
        return tuple(sorted({*self._items, *self._kind.names()}))

    def named(self, name: str) -> Item:
        """Return what has this name.

        Raises UsageError where nothing has, and where an installed package that offers it cannot be loaded.
        """
        if self._kind.of_files and ".py:" in name:
            return self._from_file(name)
        if name not in self._items:
            if name in self._kind.built_in:
                importlib.import_module(self._kind.built_in[name])
            elif name in self._kind.installed:
                self._load(self._kind.installed[name])
            else:
                own = ", or NAME.py:CLASS for your own" if self._kind.of_files else ""
                raise UsageError(
                    f"there is no {self._kind.words} '{name}'; available are: {', '.join(self.names())}{own}"
                )
        return self._items[name]

    def add_here(self, name: str, item: Item) -> None:
        """Make something known in this process alone, also a second time: what a cell of a notebook defines.

        Raises UsageError for a name that is taken.
        """
        if name not in self._here:
            self.add(name, item)
        self._here.add(name)
        self._items[name] = item

    def is_only_here(self, name: str) -> bool:
        """Whether other processes cannot find what has this name."""
        return name in self._here

    def _from_file(self, name: str) -> Item:
        """Load what a file of the user calls NAME, for ``NAME.py:CLASS``; read again whenever the file has changed."""
        file, _, wanted = name.rpartition(":")
        module = _module_of_file(Path(file), f"{self._kind.words} {name}")
        item: Any = getattr(module, wanted, None)
        if not callable(item):
            there = [
                each for each, value in vars(module).items() if getattr(value, "__module__", "") == module.__name__
            ]
            raise UsageError(
                f"{file}: it does not define the class '{wanted}'; it defines: {', '.join(there) or 'nothing'}"
            )
        found: Item = item
        return found

    def all(self) -> Mapping[str, Item]:
        """Everything by name, in order; what cannot be loaded of other packages is left out with one warning."""
        usable = {}
        for name in self.names():
            reported = name in self._unusable
            try:
                usable[name] = self.named(name)
            except _UnusablePluginError as error:
                if not reported:
                    _warn(str(error))
        return MappingProxyType(usable)

    def _load(self, entry: EntryPoint) -> None:
        """Import an installed module, which adds its item; raises _UnusablePluginError, the same each time."""
        if entry.name not in self._unusable:
            try:
                entry.load()
                if entry.name in self._items:
                    _FOREIGN[_place_of(entry)] = (
                        f"the {self._kind.words} '{entry.name}' of the package {_package_of(entry)}"
                    )
                    return
                said = f"{entry.value} does not register it"
            except Exception as error:  # whatever another's module raises must not end what does not need it
                said = f"{type(error).__name__}: {first_line(error)}"
            self._unusable[entry.name] = _UnusablePluginError(
                f"the {self._kind.words} '{entry.name}' of the package {_package_of(entry)} cannot be loaded "
                f"({said}); update or uninstall that package"
            )
        raise self._unusable[entry.name]


def _module_of_file(path: Path, what: str) -> ModuleType:
    """Run a file as a module, whose name depends on the content; raises UsageError if that fails."""
    try:
        content = read_bytes(path)
    except OSError as error:
        raise UsageError(f"{what}: {path} cannot be read ({error.strerror}); correct the path") from error
    main = sys.modules["__main__"]
    if path.resolve() == Path(getattr(main, "__file__", None) or "").resolve():  # a script must not run twice
        return main
    name = f"{path.stem}_{hashlib.sha256(content).hexdigest()[:16]}"
    if name in sys.modules:
        return sys.modules[name]
    spec = spec_from_file_location(name, path.resolve())
    assert spec is not None
    assert spec.loader is not None
    module = sys.modules[name] = module_from_spec(spec)
    try:
        spec.loader.exec_module(module)
    except Exception as error:  # whatever a user's file raises
        del sys.modules[name]
        raise UsageError(f"{what}: {where_it_failed(path.name, error)}") from error
    return module


def called_of_user(name: str) -> str:
    """What a strategy of the user is called in a message: "the strategy MyStrategy of my.py"."""
    file, _, own = name.rpartition(":")
    return f"the strategy {own} of {Path(file).name}" if file else f"the strategy {own}"


def where_it_failed(what: str, error: Exception) -> str:
    """Say that code of the user failed, and at which line of its file: the last one in the file that we called."""
    own = [frame for frame in traceback.extract_tb(error.__traceback__)[1:] if not frame.filename.startswith("<frozen")]
    if isinstance(error, SyntaxError):
        lines = [error.lineno]
    else:
        lines = [frame.lineno for frame in own if frame.filename == own[0].filename]
    line = f" at line {lines[-1]}" if lines else ""
    return f"{what} failed{line}: {type(error).__name__}: {first_line(error)} (this is your code)"


def foreign_failure(error: BaseException) -> str | None:
    """Say that code of another package failed, with file and line, if the error is of its code; else None."""
    for frame in reversed(traceback.extract_tb(error.__traceback__)):
        for place, what in _FOREIGN.items():
            if Path(frame.filename).resolve().is_relative_to(place):
                said = f"{type(error).__name__}: {first_line(error)}"  # type: ignore[arg-type]
                where = f"{Path(frame.filename).name}:{frame.lineno}"
                return f"{what} failed at {where}: {said}; correct it, or report this to its authors"
    return None


def _place_of(entry: EntryPoint) -> Path:
    """Folder of the package that an entry point is of, or the file of its module."""
    file = Path(sys.modules[entry.module].__file__ or "").resolve()
    return file.parent if "." in entry.module else file


def _package_of(entry: EntryPoint) -> str:
    """Name of the installed distribution that an entry point is of."""
    return entry.dist.name if entry.dist else entry.module


def _warn(message: str) -> None:
    """Report it once: worker processes find the same."""
    if multiprocessing.parent_process() is None:
        _log.warning("%s", message)
