"""Sessions handed over from phones on the local network."""
