"""Where on each floor a data set has fingerprints, and the walk that fills its gaps."""
