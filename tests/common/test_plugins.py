"""Registries: built-in modules, installed packages, and packages that cannot be used."""

from __future__ import annotations

import importlib
import logging
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest

from vislam2tag.common.errors import UsageError
from vislam2tag.common.plugins import Registry

GROUP = "vislam2tag_tests.colours"
REGISTERS = "from colours_known import COLOURS\nCOLOURS.add({name!r}, {item!r})\n"


@pytest.fixture
def site(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Path]:
    """A folder of importable modules with a package of two built-in colours; what a test imports is forgotten."""
    before = set(sys.modules)
    (tmp_path / "colours_known.py").write_text(
        "from vislam2tag.common.plugins import Kind, Registry\n"
        f"COLOURS = Registry(Kind('colour', {GROUP!r}, 'colours_built_in'))\n"
    )
    (tmp_path / "colours_built_in").mkdir()
    (tmp_path / "colours_built_in" / "__init__.py").touch()
    (tmp_path / "colours_built_in" / "light_blue.py").write_text(REGISTERS.format(name="light-blue", item=1))
    (tmp_path / "colours_built_in" / "is_.py").write_text(REGISTERS.format(name="is", item=2))
    monkeypatch.syspath_prepend(tmp_path)
    yield tmp_path
    for name in set(sys.modules) - before:
        if name.startswith("colours_"):
            del sys.modules[name]


def install(site: Path, package: str, module: str, name: str, code: str) -> None:
    """Install a package with one entry point, as an installer leaves it."""
    (site / f"{module}.py").write_text(code)
    metadata = site / f"{package}-1.0.dist-info"
    metadata.mkdir()
    (metadata / "METADATA").write_text(f"Metadata-Version: 2.1\nName: {package}\nVersion: 1.0\n")
    (metadata / "entry_points.txt").write_text(f"[{GROUP}]\n{name} = {module}\n")


def colours() -> Registry[int]:
    found: Registry[int] = importlib.import_module("colours_known").COLOURS
    return found


def warnings_in(caplog: pytest.LogCaptureFixture) -> list[str]:
    return [record.getMessage() for record in caplog.records if record.levelno == logging.WARNING]


@pytest.mark.usefixtures("site")
def test_only_what_is_asked_for_is_imported() -> None:
    assert colours().names() == ("is", "light-blue")
    assert not any(name.startswith("colours_built_in.") for name in sys.modules)
    assert colours().named("light-blue") == 1
    assert "colours_built_in.is_" not in sys.modules
    assert dict(colours().all()) == {"is": 2, "light-blue": 1}
    with pytest.raises(UsageError, match=r"^there is no colour 'mauve'; available are: is, light-blue$"):
        colours().named("mauve")


def test_an_installed_package_is_found(site: Path) -> None:
    install(site, "Dyes", "colours_dyed", "mauve", REGISTERS.format(name="mauve", item=3))
    assert colours().names() == ("is", "light-blue", "mauve")
    assert "colours_dyed" not in sys.modules
    assert colours().named("mauve") == 3
    assert list(colours().all().values()) == [2, 1, 3]


@pytest.mark.parametrize(
    ("code", "said"),
    [
        ("raise RuntimeError('no dye')", r"RuntimeError: no dye"),
        ("import colours_absent", r"ModuleNotFoundError: No module named 'colours_absent'"),
        (REGISTERS.format(name="puce", item=3), r"colours_dyed does not register it"),
        (
            REGISTERS.format(name="is", item=3),
            r"UsageError: there already is a colour 'is'; choose another name",
        ),
    ],
)
def test_a_package_that_cannot_be_loaded_is_one_warning(
    site: Path, caplog: pytest.LogCaptureFixture, code: str, said: str
) -> None:
    install(site, "Dyes", "colours_dyed", "mauve", code)
    for _ in range(2):
        assert {"is": 2, "light-blue": 1}.items() <= colours().all().items()
    assert "mauve" not in colours().all()
    message = f"the colour 'mauve' of the package Dyes cannot be loaded ({said}); update or uninstall that package"
    assert warnings_in(caplog) == [message]
    with pytest.raises(UsageError) as raised:
        colours().named("mauve")
    assert str(raised.value) == message


def test_a_name_taken_twice_is_refused(site: Path, caplog: pytest.LogCaptureFixture) -> None:
    install(site, "Azure", "colours_azure", "mauve", REGISTERS.format(name="mauve", item=3))
    install(site, "Dyes", "colours_dyed", "mauve", REGISTERS.format(name="mauve", item=4))
    install(site, "Extra", "colours_extra", "is", REGISTERS.format(name="is", item=5))
    assert dict(colours().all()) == {"is": 2, "light-blue": 1, "mauve": 3}
    assert warnings_in(caplog) == [
        "the colour 'mauve' of the package Dyes is skipped, because the package Azure has the same name",
        "the colour 'is' of the package Extra is skipped, because vislam2tag itself has the same name",
    ]


@pytest.mark.usefixtures("site")
def test_a_script_may_add_but_not_replace() -> None:
    colours().add("mauve", 3)
    assert colours().named("mauve") == 3
    for name in ("mauve", "light-blue"):
        with pytest.raises(UsageError, match=f"there already is a colour '{name}'"):
            colours().add(name, 4)
