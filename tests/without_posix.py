"""Imports every module and makes a small demonstration as on a system without POSIX: run by ``test_platforms``.

python -m tests.without_posix FOLDER
"""

from __future__ import annotations

import importlib
import pkgutil
import signal
import sys
from functools import partial
from pathlib import Path

HIDDEN = {"fcntl", "grp", "pwd", "resource", "termios", "tty"}
OPTIONAL = {"torch", "onnx", "onnxscript"}


class Refuse:
    """Finds none of these modules."""

    def find_spec(self, name: str, *_: object) -> None:
        """Raise for what there shall not be; leave the rest to others."""
        if name.split(".")[0] in HIDDEN | OPTIONAL:
            raise ModuleNotFoundError(f"No module named {name!r}", name=name)


sys.meta_path.insert(0, Refuse())
for name in HIDDEN:
    sys.modules.pop(name, None)
for name in ("pthread_sigmask", "SIGKILL", "SIGHUP"):
    delattr(signal, name)


def import_everything() -> int:
    """Import all modules but those of networks where what they need is not there; return how many there are."""
    import vislam2tag

    names = [info.name for info in pkgutil.walk_packages(vislam2tag.__path__, "vislam2tag.")]
    for name in names:
        try:
            importlib.import_module(name)
        except ModuleNotFoundError as error:
            if error.name not in OPTIONAL:
                raise
    return len(names)


def main(out: Path) -> None:
    """Print how many modules there are, once all is done."""
    count = import_everything()
    from vislam2tag.pipeline import demo
    from vislam2tag.simulation import survey
    from vislam2tag.simulation.scenario import regular_survey

    survey.NO_COLONS = True
    small = partial(regular_survey, floors=(0,), sessions=1, duration_s=20.0)
    vars(demo)["regular_survey"] = lambda seed, **_: small(seed)
    demo.run_demo(out, jobs=2)
    print(count)


if __name__ == "__main__":
    main(Path(sys.argv[1]))
