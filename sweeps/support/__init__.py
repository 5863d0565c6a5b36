"""What the sweeps share."""
