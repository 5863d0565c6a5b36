"""An environment over HTTP and WebSocket (`vigil serve`). Houses, goals, ids and records stay on the server."""
