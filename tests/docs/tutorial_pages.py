"""Tutorials: notebooks in the percent format (Jupytext opens them), run into pages with their pictures."""

from __future__ import annotations

import re
import subprocess
import sys
from contextlib import redirect_stdout
from io import StringIO
from pathlib import Path

import matplotlib.pyplot as plt

TUTORIALS = Path(__file__).parents[2] / "docs" / "tutorials"
CELL = re.compile(r"^# %%(?P<title>[^\n]*)\n(?P<body>.*?)(?=^# %%|\Z)", re.MULTILINE | re.DOTALL)


def tutorial_page(name: str, images: Path) -> str:
    """The page of a notebook: its text, its code, what that prints; pictures go to ``images`` as NAME_1.png, ...

    It runs in a process of its own: what it registers stays there.
    """
    command = [sys.executable, "-m", __name__, name, str(images)]
    return subprocess.run(
        command, check=True, stdout=subprocess.PIPE, encoding="utf-8", cwd=TUTORIALS.parents[1]
    ).stdout


def _run(name: str, images: Path) -> str:
    plt.switch_backend("Agg")
    names: dict[str, object] = {"__name__": "__main__"}
    parts, drawn = [], 0
    for cell in CELL.finditer((TUTORIALS / f"{name}.py").read_text(encoding="utf-8")):
        title, body = cell["title"].strip(), cell["body"].strip("\n")
        if title == "[markdown]":
            parts.append(re.sub(r"^# ?", "", body, flags=re.MULTILINE))
            continue
        parts.append(f"```python\n{body}\n```")
        with redirect_stdout(StringIO()) as said:
            exec(compile(body, f"{name}.py", "exec"), names)
        if said.getvalue():
            parts.append(f"```text\n{said.getvalue().strip()}\n```")
        for number in plt.get_fignums():
            drawn += 1
            plt.figure(number).savefig(images / f"{name}_{drawn}.png", dpi=90, bbox_inches="tight")
            parts.append(f"![{title}](../images/{name}_{drawn}.png)")
        plt.close("all")
    opened = f"This page is a notebook: open `docs/tutorials/{name}.py` in VS Code or Jupyter to run it."
    parts.insert(1, f"*{opened} In a plain script,\nadd `plt.show()` to see the pictures.*")
    return "\n\n".join(parts) + "\n"


if __name__ == "__main__":
    sys.stdout.write(_run(sys.argv[1], Path(sys.argv[2])))
