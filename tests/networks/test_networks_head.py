"""What the head says, as boxes and keypoints in px."""

import pytest

torch = pytest.importorskip("torch", reason="PyTorch is not installed; pip install 'auvdock[train]'")

from auvdock.networks.config import HeadCfg  # noqa: E402
from auvdock.networks.head import Head, Level, decode, expected_distance  # noqa: E402

BINS = 16


def sharp(distances):
    """Log-odds of distributions that are sure of whole distances: (4·bins,)."""
    return 200.0 * torch.nn.functional.one_hot(torch.tensor(distances), BINS).float().reshape(-1)


def test_a_sure_distribution_is_its_distance():
    for distance in range(BINS):
        logits = sharp([distance]).view(1, BINS)
        assert expected_distance(logits).item() == pytest.approx(distance, abs=1e-5)


def test_an_even_distribution_is_the_middle_and_two_neighbours_a_share():
    assert expected_distance(torch.zeros(1, BINS)).item() == pytest.approx((BINS - 1) / 2.0)
    logits = torch.full((1, BINS), -200.0)
    logits[0, 3], logits[0, 4] = torch.log(torch.tensor([0.25, 0.75]))
    assert expected_distance(logits).item() == pytest.approx(3.75, abs=1e-5)


def test_cells_boxes_and_keypoints_lie_where_they_should():
    coarse = Level(torch.zeros(1, 4 * BINS, 2, 3), torch.zeros(1, 1, 2, 3), torch.zeros(1, 3, 2, 3))
    fine = Level(torch.zeros(1, 4 * BINS, 4, 6), torch.full((1, 1, 4, 6), -4.0), torch.zeros(1, 3, 4, 6))
    fine.box[0, :, 1, 2] = sharp([1, 0, 3, 5])  # left, top, right, bottom of the cell in row 1, column 2
    fine.score[0, 0, 1, 2] = 2.0
    fine.keypoints[0, :, 1, 2] = torch.tensor([0.25, 0.4, -1.0])
    found = decode([fine, coarse], (8, 16), BINS)
    assert found.shape == (1, 8, 4 * 6 + 2 * 3)
    best = found[0, :, found[0, 4].argsort(descending=True)[0]]
    left, top, right, bottom = (2.5 - 1) * 8, (1.5 - 0) * 8, (2.5 + 3) * 8, (1.5 + 5) * 8
    box = [(left + right) / 2, (top + bottom) / 2, right - left, bottom - top]
    odds = torch.sigmoid(torch.tensor([2.0, -1.0])).tolist()
    expected = [*box, odds[0], (2 + 2 * 0.25) * 8, (1 + 2 * 0.4) * 8, odds[1]]
    torch.testing.assert_close(best, torch.tensor(expected), rtol=1e-5, atol=1e-4)
    # A cell without preference has its box about its own middle, as large in each direction.
    torch.testing.assert_close(found[0, :4, -1], torch.tensor([2.5, 1.5, BINS - 1.0, BINS - 1.0]) * 16.0)


def test_a_head_without_keypoints_says_none():
    head = Head(HeadCfg(("a", "b"), classes=2, keypoints=0), (16, 32), (8, 16))
    levels = head([torch.randn(1, 16, 4, 4), torch.randn(1, 32, 2, 2)])
    assert decode(levels, head.strides_px, head.bins).shape == (1, 4 + 2, 20)


@pytest.mark.parametrize("convolution", ["standard", "RFAConv"])
def test_an_untrained_head_expects_five_objects(convolution):
    torch.manual_seed(0)
    head = Head(HeadCfg(("a",), classes=1, convolution=convolution), (16,), (8,)).eval()
    with torch.no_grad():
        scores = head([1e-3 * torch.randn(1, 16, 80, 80)])[0].score.sigmoid()
    assert scores.sum().item() == pytest.approx(5.0, rel=0.2)
