"""Maps of RSSI by access point."""
