"""What tests, sweeps and benchmarks share."""
