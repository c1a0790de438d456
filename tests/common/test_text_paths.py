"""Text becomes a path exactly where a function's annotations say Path."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from vislam2tag.common.text_paths import with_paths


def joined(
    name: str, folder: Path, *rest: str, others: Sequence[Path] = (), by_name: dict[str, Path] | None = None
) -> object:
    return name, folder, rest, others, by_name


def unconcerned(name: str) -> str:
    return name


def test_only_annotated_parameters_become_paths() -> None:
    taken = with_paths(joined)("a", "b", "c", others=["d"], by_name={"e": "f"})
    assert taken == ("a", Path("b"), ("c",), [Path("d")], {"e": Path("f")})
    assert with_paths(joined)(name="a", folder=Path("b")) == ("a", Path("b"), (), (), None)


def test_what_takes_no_path_stays_as_it_is() -> None:
    assert with_paths(unconcerned) is unconcerned
    assert with_paths(Path) is Path
    assert with_paths(joined).__name__ == "joined"
