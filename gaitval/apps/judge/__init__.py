"""Models and results of OpenSim, made elsewhere, held against the limits of this project."""
