"""Many walkers at once on a GPU: the physics step in MuJoCo Warp."""
