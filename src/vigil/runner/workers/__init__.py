"""Workers: simulators in separate processes, and the episodes played in them."""
