"""Films of episodes, and the floor plan beside the frame."""
