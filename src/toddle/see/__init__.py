"""From the pictures of two cameras towards depth: calibration, rectification, and what tells that they can be trusted."""
