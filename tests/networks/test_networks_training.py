"""Training: which cells learn what, what the loss is blind to, and that a resumed training is an unbroken one."""

import pytest

torch = pytest.importorskip("torch", reason="PyTorch is not installed; pip install 'auvdock[train]'")

import numpy as np  # noqa: E402

from auvdock.core.errors import ConfigError  # noqa: E402
from auvdock.core.reader import from_mapping  # noqa: E402
from auvdock.core.strict import merge  # noqa: E402
from auvdock.dataset.training import load_training_cfg  # noqa: E402
from auvdock.networks.assignment import assign, overlaps  # noqa: E402
from auvdock.networks.config import NetworkCfg  # noqa: E402
from auvdock.networks.head import Level  # noqa: E402
from auvdock.networks.losses import Objects, losses  # noqa: E402
from auvdock.networks.network import Network  # noqa: E402
from auvdock.networks.targets import Batch, Targets  # noqa: E402
from auvdock.networks.training import Trainer  # noqa: E402
from auvdock.networks.weights import load_weights  # noqa: E402

SMALL = {
    "source": "two levels",
    "layers": [
        {"name": "stem", "block": "Conv", "channels": 8, "stride": 2},
        {"name": "fine", "block": "Conv", "channels": 16, "stride": 4},
        {"name": "coarse", "block": "Conv", "channels": 16, "stride": 2},
    ],
    "head": {"inputs": ["fine", "coarse"]},
}
CHANGES = {"crops": 1200, "batch": 8, "learning_rate": 5e-3, "warm_up_steps": 5, "average_decay": 0.9}
SCHEDULE = merge(load_training_cfg().schedule, CHANGES)


def batch_of(number, size=64, count=8):
    """Soft dots on noise, one a picture."""
    rng = np.random.default_rng(number)
    v, u = np.mgrid[:size, :size] + 0.5
    centre = rng.uniform(8.0, size - 8.0, (count, 2))
    spot = np.exp(-0.5 * ((u - centre[:, :1, None]) ** 2 + (v - centre[:, 1:, None]) ** 2) / 4.0)
    images = np.clip(240.0 * spot[..., None] + rng.normal(10.0, 3.0, (count, size, size, 3)), 0, 255)
    box = np.hstack([centre - 6.0, centre + 6.0])
    none = np.zeros(count, dtype=bool)
    targets = Targets(np.arange(count), np.zeros(count, dtype=np.int64), box, centre[:, None], none)
    return Batch(images.astype(np.uint8), targets)


def trainer(seed=0):
    torch.set_num_threads(1)
    return Trainer(from_mapping(NetworkCfg, SMALL), SCHEDULE, seed)


def cells(size=64, stride=8):
    middle = torch.arange(size // stride) * float(stride) + stride / 2.0
    return torch.stack(torch.meshgrid(middle, middle, indexing="xy"), 2).reshape(-1, 2)


def test_objects_are_learned_by_cells_inside_them_and_a_cell_learns_one():
    noise = torch.Generator().manual_seed(0)
    centres = cells()
    half = 4.0 + 20.0 * torch.rand(2, len(centres), 2, generator=noise)
    boxes = torch.cat((centres - half, centres + half), 2)
    scores = torch.rand(2, len(centres), 1, generator=noise)
    picture = torch.tensor([0, 0, 1])
    xyxy = torch.tensor([[4.0, 4.0, 44.0, 44.0], [20.0, 20.0, 60.0, 60.0], [10.0, 10.0, 26.0, 26.0]])
    cfg = SCHEDULE.assignment
    pairs = assign(scores, boxes, centres, picture, torch.zeros(3, dtype=torch.long), xyxy, cfg)
    places = list(zip(pairs.picture.tolist(), pairs.cell.tolist(), strict=True))
    assert len(set(places)) == len(places)
    assert torch.bincount(pairs.target, minlength=3).min() >= 1
    assert torch.bincount(pairs.target).max() <= cfg.cells
    middle, box = centres[pairs.cell], xyxy[pairs.target]
    assert ((middle > box[:, :2]) & (middle < box[:, 2:])).all()
    assert (picture[pairs.target] == pairs.picture).all()
    # The best cell of an object shall give its best overlap as the score, the others less.
    overlap = overlaps(boxes[pairs.picture, pairs.cell], box)
    for row in range(3):
        own = pairs.target == row
        assert pairs.weight[own].max() == pytest.approx(float(overlap[own].max()))


def test_overlap_of_known_boxes():
    a = torch.tensor([[0.0, 0.0, 2.0, 2.0], [0.0, 0.0, 2.0, 2.0], [0.0, 0.0, 1.0, 1.0]])
    b = torch.tensor([[1.0, 0.0, 3.0, 2.0], [0.0, 0.0, 2.0, 2.0], [5.0, 5.0, 6.0, 6.0]])
    torch.testing.assert_close(overlaps(a, b), torch.tensor([1.0 / 3.0, 1.0, 0.0]))


def objects(xyxy, ignored):
    box = torch.tensor(xyxy)
    middle = ((box[:, :2] + box[:, 2:]) / 2.0)[:, None]
    zero = torch.zeros(len(box), dtype=torch.long)
    return Objects(zero, zero, box, middle, torch.tensor(ignored))


def test_scores_within_an_ignored_object_cost_nothing_and_elsewhere_they_do():
    network = Network(from_mapping(NetworkCfg, SMALL)).eval()
    with torch.no_grad():
        levels = network.raw(torch.rand(1, 3, 64, 64))
        there = objects([[16.0, 16.0, 24.0, 24.0]], [True])
        before = losses(network.head, levels, there, SCHEDULE)

        def sure_at(row, column):
            score = levels[0].score.clone()
            score[0, 0, row, column] = 5.0
            changed = [Level(levels[0].box, score, levels[0].keypoints), levels[1]]
            return losses(network.head, changed, there, SCHEDULE).score

        assert sure_at(2, 2) == before.score
        assert sure_at(5, 5) > before.score + 1.0
    assert before.box == before.keypoint == before.distribution == 0.0


def test_a_perfect_answer_costs_next_to_nothing():
    """A box of whole cells about a cell's middle, all its mass in the right bins, its keypoint in the middle."""
    network = Network(from_mapping(NetworkCfg, SMALL)).eval()
    bins = network.head.bins
    levels = [
        Level(torch.zeros(1, 4 * bins, n, n), torch.full((1, 1, n, n), -20.0), torch.zeros(1, 3, n, n)) for n in (8, 4)
    ]
    row, column = 3, 4
    levels[0].score[0, 0, row, column] = 20.0
    levels[0].box.reshape(1, 4, bins, 8, 8)[0, :, 1, row, column] = 40.0
    levels[0].keypoints[0, :2, row, column] = 0.25  # 2 · 0.25 + cell: half a cell in
    middle = np.array([column, row]) * 8.0 + 4.0
    wanted = objects([[*(middle - 8.0).tolist(), *(middle + 8.0).tolist()]], [False])
    cost = losses(network.head, levels, wanted, SCHEDULE)
    assert max(float(part) for part in cost) < 1e-3


def off_px(network, number):
    """Median distance from a dot to the keypoint of the cell that is surest of one."""
    batch = batch_of(number, count=16)
    with torch.no_grad():
        said = network.eval()(torch.from_numpy(batch.images).permute(0, 3, 1, 2) / 255.0)
    best = said[:, 4].argmax(1)
    points = torch.stack([said[k, 5:7, cell] for k, cell in enumerate(best)]).numpy()
    return float(np.median(np.linalg.norm(points - batch.targets.keypoints_px[:, 0], axis=1)))


def test_it_learns_where_dots_are():
    made = trainer()
    before = off_px(made.averaged, 999)
    for k in range(SCHEDULE.steps):
        made.step(batch_of(k))
    assert before > 10.0
    assert off_px(made.averaged, 999) < 3.0


def test_a_resumed_training_is_the_unbroken_one_bit_for_bit(tmp_path):
    whole, broken = trainer(), trainer()
    told = [whole.step(batch_of(k)) for k in range(6)]
    for k in range(3):
        broken.step(batch_of(k))
    history, scores = torch.tensor(told[:3]), torch.zeros(0, 4)
    broken.keep(tmp_path / "c.pt", "dots", history, scores)
    resumed = trainer(seed=9)  # all that it begins with is replaced
    kept = resumed.restore(tmp_path / "c.pt", "dots")
    assert torch.equal(kept[0], history)
    assert kept[1].shape == (0, 4)
    assert resumed.done == 3
    assert [resumed.step(batch_of(k)) for k in range(3, 6)] == told[3:]
    for name in ("network", "averaged"):
        one, other = getattr(whole, name).state_dict(), getattr(resumed, name).state_dict()
        assert all(torch.equal(values, other[key]) for key, values in one.items())


def test_the_running_mean_lags_behind_and_is_what_is_written(tmp_path):
    made = trainer()
    for k in range(4):
        made.step(batch_of(k))
    made.keep_averaged(tmp_path / "w.pt")
    read = Network(from_mapping(NetworkCfg, SMALL)).eval()
    load_weights(read, tmp_path / "w.pt")
    written, last = read.state_dict(), made.network.state_dict()
    assert all(torch.equal(values, written[name]) for name, values in made.averaged.state_dict().items())
    assert not torch.equal(written["blocks.stem.conv.weight"], last["blocks.stem.conv.weight"])


@pytest.mark.parametrize(
    "write",
    [
        lambda path: trainer().keep(path, "other", torch.zeros(0), torch.zeros(0)),
        lambda path: path.write_bytes(b"noise" * 50),
        lambda path: torch.save([1.0], path),
        lambda path: torch.save({"recipe": "dots"}, path),
    ],
    ids=["another training", "noise", "a list", "half of one"],
)
def test_what_is_no_checkpoint_of_this_training_is_refused(tmp_path, write):
    write(tmp_path / "c.pt")
    with pytest.raises(ConfigError) as refused:
        trainer().restore(tmp_path / "c.pt", "dots")
    assert refused.value.field == "out"
    assert "\n" not in str(refused.value)
