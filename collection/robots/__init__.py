"""Arms and grippers, real and simulated, behind one interface."""
