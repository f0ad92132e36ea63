"""OpenSim's files, written and read without OpenSim."""
