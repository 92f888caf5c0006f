"""The contact models: REACH and its rivals."""
