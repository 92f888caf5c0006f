"""Labeled trials as a value: from sessions, from files, from the trials published in 2019."""
