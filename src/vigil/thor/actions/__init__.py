"""AI2-THOR's actions: each a row of a table, with its parameters and the function that carries it out."""
