"""Labelled frames for learned detectors: what is drawn, how it is rendered, labelled, written and read again."""
