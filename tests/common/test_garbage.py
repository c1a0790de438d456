"""Memory is not looked through for garbage again and again, and not given back to be asked for again."""

from __future__ import annotations

import platform
import subprocess
import sys

import pytest


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


@pytest.mark.skipif(platform.libc_ver()[0] != "glibc", reason="other C libraries decide for themselves")
def test_freed_memory_serves_what_is_allocated_next() -> None:
    code = (
        "import resource\n"
        "from vislam2tag.common.garbage import keep_freed_memory\n"
        "keep_freed_memory()\n"
        "work = lambda: [bytes(range(256)) * 20_000 for _ in range(10)]\n"
        "work()\n"
        "before = resource.getrusage(resource.RUSAGE_SELF).ru_minflt\n"
        "for _ in range(20):\n"
        "    work()\n"
        "print(resource.getrusage(resource.RUSAGE_SELF).ru_minflt - before)\n"
    )
    done = subprocess.run([sys.executable, "-c", code], check=True, capture_output=True, text=True)
    assert int(done.stdout) < 12_500, "50 MB are 12,500 pages: the system gave them once, not twenty times more"
