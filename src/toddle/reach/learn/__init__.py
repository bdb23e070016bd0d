"""Learners: ``init / update / predict``, one sample at a time."""
