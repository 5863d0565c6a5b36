"""What everything stands on and knows nothing of episodes: geometry, JSON files, settings, versions, processes."""
