"""Explorers: what to try next."""
