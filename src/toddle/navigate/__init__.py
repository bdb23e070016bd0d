"""From senses to a velocity: tasks of finding one's way, policies that do it, and how they learn it."""
