"""Assets: shapes of household things, made on demand, the catalogue of categories, and AI2-THOR's asset database."""
