"""Lists of chores: proposals of single chores, their composition into lists, and the rules of the suite `chores`."""
