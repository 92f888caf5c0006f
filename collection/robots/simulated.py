"""The simulated YuMi."""
