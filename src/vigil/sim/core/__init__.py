"""The engine-neutral simulator: a house as things, what the body and the hand can do, what is seen."""
