"""What commands do for packs of suites."""
