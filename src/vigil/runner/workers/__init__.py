"""Workers: simulators in processes of their own, and episodes played in them."""
