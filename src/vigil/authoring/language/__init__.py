"""Language: phrases that refer to things, and the sentences of instructions."""
