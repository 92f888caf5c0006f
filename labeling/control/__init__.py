"""The session's one writer: commands in, events out, and the loop it leads."""
