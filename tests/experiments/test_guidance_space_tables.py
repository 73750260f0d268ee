"""`reproduce guidance-space`: the tables as published, and the paper's own conclusions from them."""

import numpy as np

from auvdock.experiments.guidance_space import CELLS, TABLE_4, TABLE_5, cell_result, reading_result, readings


def test_cells_are_the_papers_two_tables():
    assert len(CELLS) == 48
    published = sum(sum(row) for row in TABLE_4.values()) + sum(TABLE_5.values())
    np.testing.assert_allclose(sum(cell.paper_m3 for cell in CELLS), published, rtol=1e-12)


def test_every_cell_within_a_tenth_of_a_cubic_metre_and_no_other_reading_comes_near():
    exact, *others = readings()
    result = reading_result(exact)
    assert result.cells_within == len(CELLS)
    assert result.best_tilt_deg == 6.0
    without_turbulence = next(reading for reading in others if "turbulence" in reading.name)
    assert reading_result(without_turbulence).cells_within < len(CELLS) / 2


def test_fine_grid_is_larger_than_the_papers_and_converges():
    result = cell_result(next(cell for cell in CELLS if (cell.table, cell.inward_tilt_deg) == (5, 6.0)))
    assert result.ours_m3 < result.fine_hull_m3 <= result.converged_hull_m3
    # The region is nearly convex: its own volume and that of its hull differ little.
    np.testing.assert_allclose(result.fine_voxel_m3, result.fine_hull_m3, rtol=0.03)
