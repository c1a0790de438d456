"""Label indoor radio and inertial readings with where they were taken (VI-SLAM2tag)."""

__version__ = "0.2.0"
