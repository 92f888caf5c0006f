"""The station: what stands in the laboratory, as one file names it."""
