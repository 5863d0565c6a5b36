"""Layout: rooms, walls, openings, lights and materials of a house."""
