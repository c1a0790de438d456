"""A program that imports much does not look through it for garbage again and again."""

from __future__ import annotations

import subprocess
import sys


def test_garbage_is_searched_for_seldom_and_not_at_the_end() -> None:
    code = (
        "import atexit, gc\n"
        "from vislam2tag.common.garbage import NEW_OBJECTS, search_seldom\n"
        "atexit.register(lambda: print(gc.get_freeze_count() > 0))\n"  # called after what is registered later
        "search_seldom()\n"
        "print(gc.get_threshold()[0] == NEW_OBJECTS, gc.get_freeze_count())\n"
    )
    done = subprocess.run([sys.executable, "-c", code], check=True, capture_output=True, text=True)
    assert done.stdout.split() == ["True", "0", "True"]
