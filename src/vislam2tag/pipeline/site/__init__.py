"""Everything before a walk: sites, plans of landmarks, registration, other frames."""
