"""Preparing a survey in the browser: plans, walls, landmarks, sheets and their positions."""
