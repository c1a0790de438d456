"""Preparation of a survey before it is walked: plan the places of landmarks, print their sheets, register them."""
