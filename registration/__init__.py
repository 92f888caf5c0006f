"""A known mesh and an organized depth image in, a pose with covariance out."""
