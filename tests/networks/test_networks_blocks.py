"""Blocks against what they are made to equal: plain convolutions, means, pools, and the equations of their papers."""

import pytest

torch = pytest.importorskip("torch", reason="PyTorch is not installed; pip install 'auvdock[train]'")

from network_trials import make_lived_in  # noqa: E402
from torch.nn import functional as fn  # noqa: E402

from auvdock.networks.akconv import AKConv, initial_places  # noqa: E402
from auvdock.networks.bifpn import WeightedConcat  # noqa: E402
from auvdock.networks.c2psa import Attention  # noqa: E402
from auvdock.networks.container import Container  # noqa: E402
from auvdock.networks.conv import Conv  # noqa: E402
from auvdock.networks.dynamic import DynamicConv  # noqa: E402
from auvdock.networks.ghost import GhostConv  # noqa: E402
from auvdock.networks.partial import PartialConv  # noqa: E402
from auvdock.networks.rfa import RFAConv  # noqa: E402
from auvdock.networks.sppf import SPPF  # noqa: E402

CLOSE = {"rtol": 1e-4, "atol": 1e-5}


@pytest.fixture(autouse=True)
def _repeatable():
    torch.manual_seed(0)
    with torch.no_grad():
        yield


def live(block):
    """The block in `eval` mode, as if it had been trained."""
    make_lived_in(block)
    return block.eval()


def plain(conv):
    """A `Conv` without normalisation and activation."""
    conv.norm = torch.nn.Identity()
    conv.activation = torch.nn.Identity()
    return conv


@pytest.mark.parametrize(("kernel", "stride", "groups"), [(1, 1, 1), (3, 2, 1), (5, 1, 8), (6, 2, 1)])
def test_folding_changes_no_result(kernel, stride, groups):
    conv, x = live(Conv(8, 8, kernel, stride, groups)), torch.randn(2, 8, 12, 14)
    before = conv(x)
    assert before.shape == (2, 8, 12 // stride, 14 // stride)
    conv.fold()
    conv.fold()
    torch.testing.assert_close(conv(x), before, **CLOSE)
    assert isinstance(conv.norm, torch.nn.Identity)


def test_partial_convolution_leaves_other_channels_alone():
    block, x = PartialConv(16), torch.randn(1, 16, 9, 7)
    y = block(x)
    assert torch.equal(y[:, 4:], x[:, 4:])
    torch.testing.assert_close(y[:, :4], fn.conv2d(x[:, :4], block.conv.weight, padding=1), **CLOSE)
    assert not torch.equal(y[:, :4], x[:, :4])


def test_a_ghost_comes_from_one_channel_and_5_by_5_places():
    block, x = live(GhostConv(4, 8, 3, 2)), torch.randn(1, 4, 16, 16)
    primary = block.primary(x)
    torch.testing.assert_close(block(x)[:, :4], primary, **CLOSE)
    changed = primary.clone()
    changed[0, 1, 3, 3] += 1.0
    moved = (block.ghosts(changed) - block.ghosts(primary)).abs() > 1e-6
    rows, columns = torch.where(moved[0, 1])
    assert moved[0, [0, 2, 3]].sum() == 0
    assert (rows.min(), rows.max(), columns.min(), columns.max()) == (1, 5, 1, 5)


def test_pools_in_a_row_see_as_far_as_parallel_ones():
    block, x = live(SPPF(6, 5)), torch.randn(1, 6, 20, 17)
    reduced = block.reduce(x)
    pools = [fn.max_pool2d(reduced, side, 1, side // 2) for side in (5, 9, 13)]
    torch.testing.assert_close(block(x), block.join(torch.cat((reduced, *pools), 1)), **CLOSE)


def test_dynamic_convolution_is_equation_1_for_each_picture():
    block, x = live(DynamicConv(3, 5)), torch.randn(4, 3, 8, 6)
    shares = torch.sigmoid(block.routing(x.mean((2, 3))))
    each = torch.stack([fn.conv2d(x, kernel, padding=1) for kernel in block.kernels], 1)
    mixed = (shares[:, :, None, None, None] * each).sum(1)
    torch.testing.assert_close(block(x), block.activation(block.norm(mixed)), **CLOSE)
    assert not torch.allclose(shares[0], shares[1])


def test_receptive_field_attention_that_prefers_no_place_is_a_ninth_of_a_convolution():
    block = RFAConv(2, 4)
    plain(block.field)
    plain(block.conv)
    block.weigh.weight.zero_()
    for place in range(9):  # the field, laid out as it is
        block.field.conv.weight[place::9] = fn.one_hot(torch.tensor(place), 9).view(3, 3).float()
    x = torch.rand(2, 2, 7, 5)
    torch.testing.assert_close(block(x), fn.conv2d(x, block.conv.conv.weight, padding=1) / 9.0, **CLOSE)


def test_places_are_rows_of_the_root_of_their_number():
    assert initial_places(5).tolist() == [[0, 0], [0, 1], [1, 0], [1, 1], [2, 0]]
    assert initial_places(4).tolist() == [[0, 0], [0, 1], [1, 0], [1, 1]]
    assert initial_places(3).tolist() == [[0, 0], [0, 1], [1, 0]]


@pytest.mark.parametrize("stride", [1, 2])
def test_adaptive_kernel_convolution_begins_as_a_plain_one(stride):
    block, x = AKConv(3, 5, stride), torch.randn(2, 3, 8, 10)
    plain(block.weigh)
    # Four places are a 2 × 2 kernel; what lies outside the picture reads its border.
    kernel = block.weigh.conv.weight.view(5, 3, 2, 2)
    bordered = fn.pad(x, (0, 1, 0, 1), mode="replicate")
    torch.testing.assert_close(block(x), fn.conv2d(bordered, kernel, stride=stride), **CLOSE)


def test_adaptive_kernel_convolution_reads_between_pixels_where_it_is_moved_to():
    block = AKConv(1, 1, 1, count=1)
    plain(block.weigh)
    block.weigh.conv.weight.fill_(1.0)
    _, bias = block.moves.parameters()
    bias.copy_(torch.tensor([0.25, 1.5]))  # down, right
    row, column = torch.meshgrid(torch.arange(6.0), torch.arange(7.0), indexing="ij")
    y = block((10.0 * row + column)[None, None])[0, 0]
    torch.testing.assert_close(y[:5, :5], (10.0 * (row + 0.25) + column + 1.5)[:5, :5], **CLOSE)


def test_attention_without_preference_is_the_mean_of_all_places():
    block, x = live(Attention(128)), torch.randn(2, 128, 5, 6)
    plain(block.project)
    weight = block.project.conv.weight.view(2, 128, 128, 1, 1)  # for each head: 32 queries, 32 keys, 64 values
    weight[:, :32] = 0.0
    values = fn.conv2d(x, weight[:, 64:].reshape(128, 128, 1, 1))
    mean = values.mean((2, 3), keepdim=True)
    torch.testing.assert_close(block(x), block.join(mean + block.position(values)), **CLOSE)


@pytest.mark.parametrize("near", [True, False])
def test_container_is_a_depthwise_convolution_or_attention_by_its_share(near):
    block, x = live(Container(64)), torch.randn(1, 64, 4, 5)
    block.share.fill_(-40.0 if near else 40.0)
    for values in block.project.parameters():
        values[:64] = 0.0  # queries
    placed = x + block.position(x)
    values = block.project(block.norm(placed))[:, 128:]
    context = block.near(values) if near else values.mean((2, 3), keepdim=True)
    mixed = placed + block.join(context.expand(1, 64, 4, 5))
    torch.testing.assert_close(block(x), mixed + block.feed(mixed), **CLOSE)


def test_fast_normalised_fusion():
    block = WeightedConcat(3)
    a, b, c = torch.randn(1, 2, 3, 3), torch.randn(1, 4, 3, 3), torch.randn(1, 4, 3, 3)
    block.weights.copy_(torch.tensor([1.0, 3.0, -5.0]))  # a weight below 0 counts as 0
    torch.testing.assert_close(block(a, b, c), torch.cat((a, 3.0 * b), 1) / (4.0 + 1e-4), **CLOSE)
    block.weights.copy_(torch.tensor([2.0, 1.0, 1.0]))
    torch.testing.assert_close(block(a, b, c), torch.cat((2.0 * a, b + c), 1) / (4.0 + 1e-4), **CLOSE)
