"""Commands that map and label: from run and process to evaluate."""
