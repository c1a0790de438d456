"""``--passed=FILE``: no test runs twice at one commit, for campaigns of hundreds of runs and for CI's two users.

The equals sign is needed: pytest takes a file after a space for a folder of tests.

It leaves out tests that passed at the checked-out commit according to the file, and adds a line of JSON for each that
passes: what it is, how long it took, and what it measured (``record_property``).
"""

from __future__ import annotations

import json
import subprocess
from datetime import UTC, datetime
from pathlib import Path

import pytest


def pytest_addoption(parser: pytest.Parser) -> None:
    parser.addoption(
        "--passed", type=Path, metavar="FILE", help="leave out tests that passed according to FILE; add to it"
    )


def pytest_configure(config: pytest.Config) -> None:
    file = config.getoption("--passed")
    if file and not hasattr(config, "workerinput"):
        config.pluginmanager.register(_Log(file))


def pytest_collection_modifyitems(config: pytest.Config, items: list[pytest.Item]) -> None:
    file = config.getoption("--passed")
    if file and file.exists():
        lines = [json.loads(line) for line in file.read_text(encoding="utf-8").splitlines()]
        here = _commit()
        done = {line["test"] for line in lines if line["commit"] == here}
        config.hook.pytest_deselected(items=[item for item in items if item.nodeid in done])
        items[:] = [item for item in items if item.nodeid not in done]


class _Log:
    def __init__(self, file: Path) -> None:
        self._file, self._commit = file, _commit()

    def pytest_runtest_logreport(self, report: pytest.TestReport) -> None:
        if report.when == "call" and report.passed:
            line = {
                "commit": self._commit,
                "date": datetime.now(UTC).date().isoformat(),
                "test": report.nodeid,
                "seconds": round(report.duration, 1),
                **dict(report.user_properties),
            }
            with self._file.open("a", encoding="utf-8") as file:
                file.write(json.dumps(line) + "\n")


def _commit() -> str:
    """Name of the commit, as short in each clone; with a plus where files differ from it."""
    command = ["git", "describe", "--always", "--dirty=+", "--exclude=*", "--abbrev=12"]
    return subprocess.run(command, capture_output=True, text=True, check=True, cwd=Path(__file__).parent).stdout.strip()
