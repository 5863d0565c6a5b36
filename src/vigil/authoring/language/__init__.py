"""Language: referring expressions and the sentences of instructions."""
