"""Films of episodes, with the floor plan next to the frame."""
