"""RFAConv: a convolution that weighs each place of each receptive field."""

from __future__ import annotations

from torch import Tensor, nn
from torch.nn.functional import pixel_shuffle

from auvdock.networks.conv import Conv

__all__ = ["RFAConv"]


class RFAConv(nn.Module):
    """y = W * (softmax(g¹(AvgPool(x))) · ReLU(BN(gᵏ(x)))) (Zhang et al. 2023, arXiv 2304.03198; paper B, figure 7).

    Both grouped convolutions give k² values for each channel and place: the receptive field laid out, and its weights,
    which are 1 in sum. The product is a picture k times as large, and W steps through it by k.

    Args:
        c_in: channels of x, (batch, c_in, h, w).
        c_out: channels of y, (batch, c_out, h, w).
        kernel: k, odd.
    """

    def __init__(self, c_in: int, c_out: int, kernel: int = 3) -> None:
        """Make the weights' branch, the field's branch and the convolution."""
        super().__init__()
        laid_out = c_in * kernel**2
        self.kernel = kernel
        self.pool = nn.AvgPool2d(kernel, 1, kernel // 2)
        self.weigh = nn.Conv2d(c_in, laid_out, 1, groups=c_in, bias=False)
        self.field = Conv(c_in, laid_out, kernel, groups=c_in, activation=nn.ReLU)
        self.conv = Conv(c_in, c_out, kernel, kernel, padding=0)

    def forward(self, x: Tensor) -> Tensor:
        """Weigh, lay out, convolve."""
        batch, channels, h, w = x.shape
        k = self.kernel
        weights = self.weigh(self.pool(x)).view(batch, channels, k * k, h, w).softmax(2)
        field = self.field(x).view(batch, channels, k * k, h, w) * weights
        return self.conv(pixel_shuffle(field.view(batch, channels * k * k, h, w), k))
