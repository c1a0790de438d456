"""Data formats: one module for each, which reads, writes, or both, and registers itself."""
