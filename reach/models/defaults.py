"""Default parameters of the contact models, and why: docs/decisions/0010."""

FRICTION = 0.4
"""Coefficient between silicone pads and printed plastic."""
COMPLIANCE = 2e-4
"""kappa [m/N]: 20 N press a pad 4 mm deep, within its limit of 5.3 mm."""
TORSION = 0.005
"""Torsional coefficient gamma of the soft point contact [m]."""
POSE_TRANSLATION = 0.001
"""Standard deviation of each coordinate of the part's pose [m]."""
POSE_ROTATION = 0.01
"""Standard deviation of the part's rotation about each axis [rad]."""
