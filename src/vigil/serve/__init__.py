"""An environment over HTTP and WebSocket: house, goal, ids and records stay with the server (`vigil serve`)."""
