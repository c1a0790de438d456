"""From labels (sources, sessions, build, finish) or others' files to data sets; from these to formats and maps."""
