"""Simulated true walks: route, gait, several floors."""
