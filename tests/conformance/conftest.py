"""The app's core, compiled once for all tests."""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.conformance.java import compiled_core


@pytest.fixture(scope="package")
def core(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return compiled_core(tmp_path_factory.mktemp("core"))
