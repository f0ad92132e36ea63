"""Environment, learning, stored policies, rollouts."""
