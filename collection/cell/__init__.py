"""The simulated cell that simulated arm, hand and camera share."""
