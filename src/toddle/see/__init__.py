"""From pictures to depth: calibration, rectification, disparity, and noticing that a camera can not be trusted."""
