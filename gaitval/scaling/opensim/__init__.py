"""The skeleton of a model of OpenSim, as `judge` reads it from its file."""
