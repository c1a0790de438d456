"""What every long job needs: which sessions, worker processes, an output folder that is claimed and written whole."""
