"""From the labels of a walk to its fingerprints: readings grouped by scan or window, motion, magnetic windows."""
