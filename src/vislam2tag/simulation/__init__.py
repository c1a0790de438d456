"""Walks, tracker, radio and inertial sensors with known truth."""
