"""What a robot would read from a sensor: datasets, perception tasks, shape reconstruction."""
