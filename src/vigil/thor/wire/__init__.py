"""Communication of the engine with AI2-THOR's client, over two named pipes or over HTTP."""
