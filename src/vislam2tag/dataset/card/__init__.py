"""The card of a data set: README, citation, metadata for repositories and machine-learning libraries, checksums."""
