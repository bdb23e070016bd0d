"""The campaign that proves the walker, in physics: ``python -m benchmarks.walking``."""
