"""Splits into training and test parts, and how far they leak."""
