"""The docking world and the Gymnasium environment around it."""
