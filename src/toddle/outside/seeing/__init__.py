"""Cameras, pictures and depth on disk."""
