"""Access points and beacons: what is known of them, radios with several addresses, privacy."""
