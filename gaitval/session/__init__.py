"""Import of a laboratory's session: from its files to body, motion, moments, faults of the
measurement, and the subject's folder, with OpenSim's files.
"""
