"""Label indoor radio and inertial readings with where they were taken (VI-SLAM2tag)."""

from typing import TYPE_CHECKING

__version__ = "0.2.0"

if TYPE_CHECKING:
    from vislam2tag.pipeline.labels.process import map_walk as map_walk
else:

    def __getattr__(name: str) -> object:
        """Import :func:`vislam2tag.api.map_walk` when it is first used; nothing else is loaded before."""
        if name != "map_walk":
            raise AttributeError(f"module 'vislam2tag' has no attribute '{name}'")
        from vislam2tag.pipeline.labels.process import map_walk

        return map_walk
