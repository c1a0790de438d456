"""What a run says about itself: its totals and one HTML page."""
