"""Seeing, measured against a known truth."""
