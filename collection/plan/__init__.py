"""The plan of an experiment: grasps, repeats and order, as values and as files."""
