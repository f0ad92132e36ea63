"""The walk and the person in other tools' formats: MuJoCo, Gymnasium, OpenSim, C3D."""
