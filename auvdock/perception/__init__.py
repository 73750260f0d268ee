"""Pixels to pose: detectors, tracks, identities, PnP, bearings."""
