"""From a survey folder to an output folder."""
