"""Simulated sessions as files: the published layout, the phone app's, and every trap."""
