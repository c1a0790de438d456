from __future__ import annotations

import shutil
import subprocess
import sys
import tarfile
import zipfile
from pathlib import Path

import pytest

import vislam2tag
from vislam2tag.common.commit import COMMIT_FILE, commit_of_checkout, commit_of_package

ROOT = Path(__file__).parents[2]
BUILDING = ("hatch_build.py", "pyproject.toml", "README.md", "LICENSE")


def git(folder: Path, *words: str) -> str:
    names = ("-c", "user.name=A", "-c", "user.email=a@b")
    return subprocess.run(
        ["git", *names, *words], cwd=folder, check=True, stdout=subprocess.PIPE, text=True
    ).stdout.strip()


@pytest.fixture
def checkout(tmp_path: Path) -> Path:
    """A repository with what a build of the package needs, and two of its modules."""
    made = tmp_path / "checkout"
    for name in ("src/vislam2tag/__init__.py", "src/vislam2tag/common/commit.py", *BUILDING):
        (made / name).parent.mkdir(parents=True, exist_ok=True)
        shutil.copy(ROOT / name, made / name)
    for pages in sorted({path.parent for path in (ROOT / "docs").rglob("*.md")}):
        (made / pages.relative_to(ROOT)).mkdir(parents=True, exist_ok=True)
        shutil.copy(pages / "index.md", made / pages.relative_to(ROOT))
    git(made, "init", "--quiet")
    git(made, "add", ".")
    git(made, "commit", "--quiet", "--message", "All")
    return made


def test_what_is_built_records_the_commit_of_its_checkout(checkout: Path, tmp_path: Path) -> None:
    """The wheel is built from the source distribution, where git knows nothing."""
    commit = git(checkout, "rev-parse", "--short=10", "HEAD")
    build(checkout, tmp_path, "sdist")
    (sdist,) = tmp_path.glob("*.tar.gz")
    with tarfile.open(sdist) as archive:
        archive.extraction_filter = getattr(tarfile, "data_filter", None)  # Python 3.11.2 has none
        archive.extractall(tmp_path / "unpacked")
    (unpacked,) = (tmp_path / "unpacked").iterdir()
    build(unpacked, tmp_path, "wheel")
    (wheel,) = tmp_path.glob("*.whl")
    with zipfile.ZipFile(wheel) as archive_of_wheel:
        assert archive_of_wheel.read(f"vislam2tag/{COMMIT_FILE}").decode() == f"{commit}\n"
    assert commit_of_package(unpacked / "src/vislam2tag") == commit
    assert not (checkout / "src/vislam2tag" / COMMIT_FILE).exists()


def build(checkout: Path, out: Path, target: str) -> None:
    subprocess.run(
        [sys.executable, "-m", "hatchling", "build", "--target", target, "--directory", str(out)],
        cwd=checkout,
        check=True,
        stdout=subprocess.DEVNULL,
    )


def test_a_checkout_with_changes_is_no_commit(checkout: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("GIT_DIR", str(ROOT / ".git"))  # as in a hook of another repository
    package = checkout / "src/vislam2tag"
    commit = commit_of_package(package)
    assert commit
    assert not commit.endswith("-dirty")
    (package / "__init__.py").write_text("", encoding="utf-8")
    assert commit_of_package(package) == f"{commit}-dirty"


def test_without_git_there_is_a_version_all_the_same(
    checkout: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "damaged/.git").mkdir(parents=True)
    assert commit_of_checkout(tmp_path) is None
    assert commit_of_checkout(tmp_path / "damaged") is None
    monkeypatch.setenv("PATH", "")
    assert commit_of_checkout(checkout) is None
    command = [sys.executable, "-m", "vislam2tag", "--version"]
    shown = subprocess.run(command, capture_output=True, text=True, check=True)
    assert (shown.stdout, shown.stderr) == (f"{vislam2tag.__version__}\n", "")
