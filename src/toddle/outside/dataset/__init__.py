"""Drives that were recorded, kept as a LeRobot dataset (format v3.0): https://github.com/huggingface/lerobot.

`writer.Writer` appends a `toddle.navigate.cloning.recording.Recording` at a time, `reader.read_dataset` reads them back
bit for bit, `layout` says what lies where.
"""
