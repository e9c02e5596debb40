"""The stream of frames over WebSocket: subscriptions, sending, limits on what a client sends."""
