"""Measurements of what learns to navigate."""
