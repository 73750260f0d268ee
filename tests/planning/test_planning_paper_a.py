"""Paper A's light model: the published cells, limits in closed form, and what its grid costs."""

import math

import numpy as np
import pytest

from auvdock.core.errors import ConfigError
from auvdock.planning.paper_a import (
    PaperAGrid,
    PaperALamp,
    PaperALightCfg,
    count_visible,
    hull_volume_m3,
    lamp_visible,
    paper_a_ring,
)


@pytest.mark.parametrize(
    ("count", "angle", "tilt", "published"),
    [(4, 5, 0, 24.1), (10, 10, 0, 232.9), (6, 60, 0, 264.8), (8, 50, 0, 345.0), (6, 45, 6, 324.8), (6, 45, -4, 195.9)],
)
def test_published_cells(count, angle, tilt, published):
    grid = PaperAGrid()
    seen = count_visible(paper_a_ring(count, angle, tilt), PaperALightCfg(), grid) >= 4
    assert hull_volume_m3(seen, grid) == pytest.approx(published, abs=0.1)


def test_one_lamp_on_its_axis_reaches_the_root_of_the_published_equation():
    cfg = PaperALightCfg(turbulence=False)
    grid = PaperAGrid((0.0, 0.1), (0.0, 0.1), (0.2, 40.0), (2, 2, 40001))
    seen = lamp_visible(PaperALamp((0.0, 0.0, 0.0), 0.0, 0.0, 45.0), cfg, grid)[0, 0]
    d = grid.axes()[2]
    c, alpha = 0.13, math.radians(22.5)
    spread = alpha + 0.01 * c * d
    level = 10.0 / (2 * math.pi * (1 - math.cos(alpha))) * np.exp(-0.18 * 1.039 * d - 0.10 * 1.13 * d) * 0.975
    level = level / (1 + (spread * d) ** 1.2) - 0.0026
    assert d[seen][-1] == pytest.approx(d[level >= 0.02][-1], abs=1e-9)
    assert seen[: np.flatnonzero(seen)[-1]].all()


def test_tilts_mirror_each_other_without_turbulence():
    cfg, grid = PaperALightCfg(turbulence=False), PaperAGrid()
    seen = count_visible(paper_a_ring(6, 45.0, 6.0), cfg, grid)
    np.testing.assert_array_equal(seen, seen[:, ::-1])


@pytest.mark.parametrize("size", [(1.0, 2.0, 3.0), (4.0, 4.0, 0.5)])
def test_hull_of_a_box_is_the_box(size):
    x, y, z = ((0.0, side) for side in size)
    grid = PaperAGrid(x, y, z, (5, 6, 7))
    assert hull_volume_m3(np.ones(grid.counts, dtype=bool), grid) == pytest.approx(math.prod(size))
    flat = np.zeros(grid.counts, dtype=bool)
    flat[:, :, 0] = True
    assert hull_volume_m3(flat, grid) == 0.0


@pytest.mark.parametrize("change", [{"threshold": 0.0}, {"intensity": float("nan")}, {"scattering_per_m": -1.0}])
def test_refuses_what_gives_no_light(change):
    with pytest.raises(ConfigError, match=f"^{next(iter(change))}: "):
        PaperALightCfg(**change)
