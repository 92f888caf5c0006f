"""The MuJoCo grasp world: pads as sprung pins."""
