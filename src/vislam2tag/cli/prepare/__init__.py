"""Commands that prepare a survey: site, plan, sheets, register."""
