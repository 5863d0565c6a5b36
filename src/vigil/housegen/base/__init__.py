"""What the parts of the house generator share: random draws, solids, specs, and models of furniture."""
