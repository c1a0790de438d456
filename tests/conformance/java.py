"""The app's core, compiled here from its sources: what writes sessions on phones."""

from __future__ import annotations

import shutil
import subprocess
from pathlib import Path

import pytest

CORE = Path(__file__).resolve().parents[2] / "android" / "core" / "src"
REPLAY, UPLOAD = "org.vislam2tag.tools.ReplayMain", "org.vislam2tag.tools.UploadMain"


def compiled_core(out: Path) -> Path:
    """Compile the core and its tools into a folder; skips the test where there is no JDK."""
    if shutil.which("javac") is None or shutil.which("java") is None:
        pytest.skip("no JDK (javac and java) is installed")
    sources = [str(path) for part in ("main", "tools") for path in sorted((CORE / part).rglob("*.java"))]
    command = ["javac", "-nowarn", "-encoding", "UTF-8", "-d", str(out), *sources]
    done = subprocess.run(command, capture_output=True, text=True, timeout=300, check=False)
    assert done.returncode == 0, done.stderr
    return out


def replay(core: Path, script: Path, out: Path) -> subprocess.CompletedProcess[str]:
    """Let the app's core write a session from a script of what a phone saw."""
    return _run(core, REPLAY, str(script), str(out))


def upload(core: Path, link: str, outbox: Path, *zips: Path) -> subprocess.CompletedProcess[str]:
    """Hand sessions' zips over with the app's own client, and what waits in its outbox, a file."""
    return _run(core, UPLOAD, link, str(outbox), *map(str, zips))


def _run(core: Path, main: str, *arguments: str) -> subprocess.CompletedProcess[str]:
    command = ["java", "-Duser.language=de", "-Duser.country=DE", "-cp", str(core), main, *arguments]
    return subprocess.run(command, capture_output=True, text=True, timeout=120, check=False)
