"""Commands that collect: receive, inspect, attach, sightings, simulate."""
