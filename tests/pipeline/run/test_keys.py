"""A key changes with the source that results follow from and with its libraries, and with nothing else."""

from __future__ import annotations

import ast
import importlib.util
import sys
from collections.abc import Iterator
from pathlib import Path
from types import ModuleType

import pytest

import vislam2tag as package
from vislam2tag.pipeline.run import keys
from vislam2tag.pipeline.run.keys import code_key

PROCESS = ("vislam2tag.pipeline.labels.session", "vislam2tag.estimation.strategies.smoother")


@pytest.fixture
def _read_anew() -> Iterator[None]:
    """Modules are read once a process; these tests change them."""
    keys._module.cache_clear()
    yield
    keys._module.cache_clear()


def change(monkeypatch: pytest.MonkeyPatch, module: str) -> None:
    """Let a module of ours read as if a comment stood at its end; all others are as they were read before."""
    spec = importlib.util.find_spec(module)
    assert spec is not None
    read = Path.read_bytes
    monkeypatch.setattr(Path, "read_bytes", lambda path: read(path) + b"# changed\n" * (str(path) == spec.origin))
    kept = keys._module
    monkeypatch.setattr(keys, "_module", lambda name: (kept.__wrapped__ if name == module else kept)(name))


@pytest.mark.parametrize(
    ("module", "counts"),
    [
        ("vislam2tag.core.transforms", True),
        ("vislam2tag.estimation.tracker_errors", True),
        ("vislam2tag.sessions.registry", True),
        ("vislam2tag.sessions", True),
        ("vislam2tag.labeling.settings", True),
        ("vislam2tag.estimation.settings", True),
        ("vislam2tag.settings", False),
        ("vislam2tag.preparation.planning.settings", False),
        ("vislam2tag.estimation.strategies.local", False),
        ("vislam2tag.pipeline.labels.evaluate", False),
        ("vislam2tag.views.page", False),
        ("vislam2tag.views.panels", False),
        ("vislam2tag.cli.app", False),
    ],
)
def test_what_process_can_import_counts(monkeypatch: pytest.MonkeyPatch, module: str, counts: bool) -> None:
    before = code_key(*PROCESS)
    change(monkeypatch, module)
    assert (code_key(*PROCESS) != before) is counts


def test_modules_that_are_imported_by_name_count(monkeypatch: pytest.MonkeyPatch) -> None:
    entry = "vislam2tag.positioning.models.regression_net"
    before = code_key(entry)
    change(monkeypatch, "vislam2tag.positioning.networks.regression")
    assert code_key(entry) != before


@pytest.mark.parametrize(
    "source",
    [
        "import plug.inner.drift",
        "import numpy as np, plug.inner.drift as drift",
        "def late():\n    from plug.inner import drift",
        "from plug.inner import (\n    other,  # (as before)\n    drift,\n)",
        "from plug.inner import \\\n    other, \\\n    drift",
        "from .inner import drift",
        "try: from . import inner; import plug.inner.drift\nexcept ImportError: pass",
        '"""Reads what comes\n\nfrom the tracker."""\nimport plug.inner.drift',
        "import_module('plug.inner.drift')",
    ],
)
def test_imports_are_found_however_they_are_written(source: str) -> None:
    assert "plug.inner.drift" in set(keys._imports(source.encode(), "plug"))


def test_no_import_of_ours_is_missed() -> None:
    for file in sorted(Path(package.__file__).parent.rglob("*.py")):
        nodes = list(ast.walk(ast.parse(file.read_bytes())))
        imported = {alias.name for node in nodes if isinstance(node, ast.Import) for alias in node.names}
        imported |= {node.module for node in nodes if isinstance(node, ast.ImportFrom) and node.module}
        assert imported <= set(keys._imports(file.read_bytes(), "vislam2tag")), file


def test_libraries_count_with_their_versions(monkeypatch: pytest.MonkeyPatch) -> None:
    before = code_key(*PROCESS)
    monkeypatch.setattr(keys, "_version", lambda library: "0.1" if library == "scipy" else None)
    with_old_scipy = code_key(*PROCESS)
    monkeypatch.setattr(keys, "_version", lambda library: "0.2" if library == "scipy" else None)
    assert len({before, with_old_scipy, code_key(*PROCESS)}) == 3
    monkeypatch.setattr(keys, "_version", lambda library: "0.3" if library == "torch" else None)
    without = code_key(*PROCESS)
    monkeypatch.setattr(keys, "_version", lambda library: "0.4" if library == "torch" else None)
    assert code_key(*PROCESS) == without, "the smoother uses no PyTorch"


@pytest.fixture
def plug_in(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A package of somebody else; ``plug.strategy`` uses ``plug.inner.drift``, and nothing uses ``plug.other``."""
    files = {
        "__init__.py": "",
        "strategy.py": "def map():\n    from .inner import drift\n    import vislam2tag.core.transforms\n",
        "inner/__init__.py": "",
        "inner/drift.py": "from .. import strategy\n",
        "other.py": "",
    }
    for name, text in files.items():
        path = tmp_path / "plug" / name
        path.parent.mkdir(exist_ok=True)
        path.write_text(text)
    monkeypatch.syspath_prepend(tmp_path)
    keys._spec.cache_clear()
    return tmp_path / "plug"


@pytest.mark.usefixtures("_read_anew")
@pytest.mark.parametrize(
    ("changed", "counts"), [("strategy.py", True), ("inner/drift.py", True), ("__init__.py", True), ("other.py", False)]
)
def test_a_plug_in_counts_with_its_own_package(plug_in: Path, changed: str, counts: bool) -> None:
    entries = (*PROCESS, "plug.strategy")
    before = code_key(*entries)
    (plug_in / changed).write_text(f"{(plug_in / changed).read_text()}# changed\n")
    assert code_key(*entries) == before, "modules are read once a process"
    keys._module.cache_clear()
    assert (code_key(*entries) != before) is counts
    assert "plug" not in sys.modules


def test_what_is_typed_at_a_prompt_has_a_key_for_once(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "__main__", ModuleType("__main__"))
    assert code_key("__main__") != code_key("__main__")
    assert code_key(*PROCESS) == code_key(*PROCESS)


@pytest.mark.usefixtures("_read_anew")
def test_a_script_counts_with_its_source(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    script = ModuleType("__main__")
    script.__file__ = str(tmp_path / "script.py")
    monkeypatch.setitem(sys.modules, "__main__", script)
    (tmp_path / "script.py").write_text("import numpy\n")
    before = code_key("__main__")
    (tmp_path / "script.py").write_text("import numpy as np\n")
    assert code_key("__main__") == before, "modules are read once a process"
    keys._module.cache_clear()
    assert code_key("__main__") != before
