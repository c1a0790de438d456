"""Label indoor radio and inertial readings with where they were taken (VI-SLAM2tag)."""

from importlib.metadata import version

__version__ = version("vislam2tag")
