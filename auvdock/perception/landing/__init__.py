"""Perception of a landing: lights far (level I), AprilTag near (level II), both fused (paper C)."""
