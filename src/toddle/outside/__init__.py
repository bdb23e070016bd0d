"""All that touches the world: files, pictures, the terminal, simulators."""
