"""Maps of RSSI by access point: readings of a floor, Gaussian processes, who hears what, and GeoTIFF."""
