"""Recordings of episodes for Rerun's viewer."""
