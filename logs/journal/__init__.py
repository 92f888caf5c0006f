"""The journal: what happened in a session, one checksummed line an event."""
