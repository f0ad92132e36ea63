"""Write and read OpenSim's files without OpenSim."""
