"""Compile-time stubs of Android's classes from the text of their signatures."""
