"""From labels (sources, build, finish) or other formats to data sets, and from these to formats and radio maps."""
