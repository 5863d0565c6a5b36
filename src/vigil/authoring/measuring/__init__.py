"""What is measured of an episode in its house."""
