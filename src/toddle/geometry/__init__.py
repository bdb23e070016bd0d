"""Pure mathematics: rotations, frames, splines, pinhole cameras."""
