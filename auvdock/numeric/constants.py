"""Constants that compiled functions of several files read: each stands here and nowhere else."""

from __future__ import annotations

__all__ = ["BLUE", "HALF_SCORE_SNR", "LEAST_EXPONENT", "RED", "SATURATED_CODE", "TAG_CELLS", "TAG_SQUARE_CELLS"]

BLUE = 0
"""Class id of a blue light: those of the array and the far one."""
RED = 1
"""Class id of a red light: those at the entrance."""

SATURATED_CODE = 250
"""Samples of 8 bits from this code upwards tell no more than that there was at least so much light (ours)."""

HALF_SCORE_SNR = 10.0
"""Signal over noise s of a light that scores ½: detectors and their model alike score s / (s + 10) (ours)."""

LEAST_EXPONENT = -60.0
"""Of a Gaussian; what is left there is below the rounding of any halo (ours)."""

TAG_SQUARE_CELLS = 8
"""Cells along an edge of a tag's black square, whose size is the tag's: six of data and a border of one (AprilTag
family 36h11, Olson 2011)."""
TAG_CELLS = TAG_SQUARE_CELLS + 2
"""Cells along an edge with the white margin, one wide."""
