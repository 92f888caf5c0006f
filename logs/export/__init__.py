"""The labeled data set in the formats people load."""
