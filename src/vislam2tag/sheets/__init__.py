"""Printable landmarks: images that a tracker recognises, on sheets of true size."""
