"""Labels in other people's formats: COCO's keypoints and YOLO's text.

COCO (Lin et al. 2014) counts pixels from the image's corner, so that the middle of the first pixel is (0.5, 0.5); ours
is (0, 0), and half a pixel is added here. Ignored labels are `iscrowd` there, which its evaluator takes for "ignore".
YOLO's text has no such thing: they go into files of their own in `ignored/`, for trainers that mask them.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from auvdock.dataset.labels import CLASSES

__all__ = ["coco", "data_yaml", "yolo_text"]

_MIDDLE = 0.5


def coco(split: str, scenes: Sequence[Mapping[str, Any]], version: str) -> dict[str, Any]:
    """A split as COCO's keypoints want it: one keypoint, "centre", for each box.

    Beyond COCO an annotation has `ignored` (the reason), `lamps`, `range_m`, `c_range`, `snr`, `side_px` and, of a tag,
    `corners`; an image has `facts`.
    """
    images: list[dict[str, Any]] = []
    annotations: list[dict[str, Any]] = []
    for scene in scenes:
        for frame in scene["frames"]:
            size = {"width": frame["width"], "height": frame["height"]}
            image_id = len(images) + 1
            facts = {"scene_seed": scene["seed"], **frame["facts"]}
            images.append({"id": image_id, "file_name": f"{frame['name']}.png", **size, "facts": facts})
            for label in frame["labels"]:
                annotations.append(_annotation(label, len(annotations) + 1, image_id))
    categories = [
        {"id": class_id + 1, "name": name, "supercategory": "beacon", "keypoints": ["centre"], "skeleton": []}
        for class_id, name in CLASSES.items()
    ]
    info = {"description": f"auvdock dataset, split {split}", "version": version}
    return {"info": info, "licenses": [], "images": images, "annotations": annotations, "categories": categories}


def yolo_text(frame: Mapping[str, Any], *, ignored: bool) -> str:
    """A frame's positive or its ignored labels, a line each: class, middle, size, keypoint (0 … 1), visibility."""
    width, height = frame["width"], frame["height"]
    lines: list[str] = []
    for label in frame["labels"]:
        if bool(label["ignored"]) != ignored:
            continue
        left, top, right, bottom = (part + _MIDDLE for part in label["xyxy"])
        x, y = (part + _MIDDLE for part in label["centre_px"])
        box = ((left + right) / 2.0 / width, (top + bottom) / 2.0 / height)
        size = ((right - left) / width, (bottom - top) / height)
        numbers = (*box, *size, x / width, y / height)
        lines.append(f"{label['class_id']} {' '.join(f'{part:.6f}' for part in numbers)} {label['visibility']}\n")
    return "".join(lines)


def data_yaml() -> str:
    """What YOLO's trainers read first."""
    names = "".join(f"  {class_id}: {name}\n" for class_id, name in CLASSES.items())
    return f"train: train/images\nval: val/images\ntest: test/images\nkpt_shape: [1, 3]\nflip_idx: [0]\nnames:\n{names}"


def _annotation(label: Mapping[str, Any], number: int, image_id: int) -> dict[str, Any]:
    left, top, right, bottom = label["xyxy"]
    x, y = (part + _MIDDLE for part in label["centre_px"])
    width, height = right - left, bottom - top
    content = {
        "id": number,
        "image_id": image_id,
        "category_id": label["class_id"] + 1,
        "bbox": [round(part, 3) for part in (left + _MIDDLE, top + _MIDDLE, width, height)],
        "area": round(width * height, 3),
        "iscrowd": int(bool(label["ignored"])),
        "keypoints": [round(x, 3), round(y, 3), label["visibility"]],
        "num_keypoints": 1,
    }
    extra = {key: label[key] for key in ("ignored", "lamps", "range_m", "c_range", "snr", "side_px")}
    if label["corners_px"]:
        extra["corners"] = [[round(part + _MIDDLE, 3) for part in corner] for corner in label["corners_px"]]
    return {**content, **extra}
