"""Default parameters of the contact models; the evidence is in docs/decisions/0012."""

FRICTION = 0.4
"""Coefficient mu between silicone pads and printed plastic."""
COMPLIANCE = 2e-4
"""kappa [m/N]: 20 N press a pad 4 mm deep, within its limit of 5.3 mm."""
TORSION = 0.004
"""Torsional coefficient gamma of the soft point contact [m]: that of a pad in full flat contact,
friction times the mean distance of its points from its center (9 mm)."""
POSE_TRANSLATION = 0.001
"""Standard deviation of each coordinate of the part's pose where a station states none [m]."""
POSE_ROTATION = 0.003
"""Standard deviation of the part's rotation about each axis where a station states none [rad]."""
