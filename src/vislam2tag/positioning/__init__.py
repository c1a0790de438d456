"""Positioning models: estimators over radio scans, their training, their benchmark protocol."""
