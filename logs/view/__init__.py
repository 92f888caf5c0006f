"""The Rerun views, derived from records and annotations."""
