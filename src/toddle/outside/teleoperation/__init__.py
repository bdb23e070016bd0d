"""A person, or a file of theirs, commands the robot."""
