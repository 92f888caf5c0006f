"""The simulated depth cameras."""
