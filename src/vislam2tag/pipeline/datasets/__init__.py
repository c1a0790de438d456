"""From labels to data sets, and from data sets to other formats and maps."""
