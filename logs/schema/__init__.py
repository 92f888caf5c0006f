"""The one source of the record types, and what is generated from it."""
