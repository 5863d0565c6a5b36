"""How the engine and AI2-THOR's client speak: over two named pipes, or over HTTP."""
