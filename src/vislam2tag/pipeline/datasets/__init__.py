"""From labels (sources, build, finish) or others' files to data sets; from these to formats and maps."""
