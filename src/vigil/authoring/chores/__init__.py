"""Lists of chores: proposals of single chores, their combination into lists, and the rules of the suite `chores`."""
