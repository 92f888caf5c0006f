"""Depth cameras, real and simulated, behind one interface."""
