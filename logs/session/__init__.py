"""A session's folder: journal, records and index, and how they are brought together again."""
