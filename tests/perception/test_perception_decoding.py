"""What a network says as candidates in px: by hand, and by the network's own decoding where PyTorch is there."""

import numpy as np
import pytest

from auvdock.perception.decoding import decode_cells, read_candidates

BINS = 16


def test_a_whole_output_by_hand():
    found = np.array(
        [  # one column a cell: centre, size, two classes, a keypoint
            [100.0, 50.0, 8.0, 4.0, 0.2, 0.7, 101.0, 51.0, 0.9],
            [10.0, 20.0, 2.0, 6.0, 0.6, 0.1, 10.5, 20.5, 0.9],
            [30.0, 40.0, 2.0, 6.0, 0.29, 0.1, 30.0, 40.0, 0.9],
        ]
    ).T
    read = read_candidates(found, 2, 0.3)
    np.testing.assert_array_equal(read.xyxy, [[96.0, 48.0, 104.0, 52.0], [9.0, 17.0, 11.0, 23.0]])
    assert read.scores.tolist() == [0.7, 0.6]
    assert read.classes.tolist() == [1, 0]
    np.testing.assert_array_equal(read.keypoints_px, [[[101.0, 51.0]], [[10.5, 20.5]]])
    assert read_candidates(found[:6], 2, 0.3).keypoints_px.shape == (2, 0, 2)


def test_cells_by_hand():
    said = np.full((1, 4 * BINS + 3), -300.0)
    for side, distance in enumerate((1, 0, 3, 5)):
        said[0, side * BINS + distance] = 300.0
    said[0, 1:3] = 300.0  # left: 1 and 2 alike
    said[0, -3:] = 0.25, 0.4, 2.0
    box, points = decode_cells(said, np.array([[2, 1]]), 8, BINS)
    np.testing.assert_allclose(box, [[(2.5 - 1.5) * 8, 1.5 * 8, (2.5 + 3) * 8, (1.5 + 5) * 8]])
    np.testing.assert_allclose(points, [[[(2 + 0.5) * 8, (1 + 0.8) * 8]]])


def test_parts_are_the_whole():
    torch = pytest.importorskip("torch", reason="PyTorch is not installed; pip install 'auvdock[train]'")
    from auvdock.networks.head import Level, decode

    torch.manual_seed(0)
    level = Level(torch.randn(1, 4 * BINS, 4, 6), torch.randn(1, 2, 4, 6), torch.randn(1, 6, 4, 6))
    whole = read_candidates(decode([level], [16], BINS)[0].numpy(), 2, 0.0)
    said = torch.cat((level.box, level.keypoints), 1)[0].flatten(1).T.numpy()
    rows, columns = np.divmod(np.arange(24), 6)
    box, points = decode_cells(said, np.column_stack((columns, rows)), 16, BINS)
    np.testing.assert_allclose(box, whole.xyxy, rtol=1e-4, atol=1e-3)
    np.testing.assert_allclose(points, whole.keypoints_px, rtol=1e-4, atol=1e-3)
