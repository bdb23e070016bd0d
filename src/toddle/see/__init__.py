"""From the pictures of two cameras towards depth: calibration, rectification, and whether they can be trusted."""
