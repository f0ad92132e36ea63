"""The body: segments, kinematic tree, rotations, URDF, parameters μ."""
