"""AI2-THOR's actions. Each is a row of a table, with its parameters and the function that carries it out."""
