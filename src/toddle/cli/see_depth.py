"""``toddle see depth``: how far everything is, from a pair of pictures or two folders of them."""

from __future__ import annotations

import json
import sys
import time
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal

from toddle.cli.arguments import parse
from toddle.cli.options import POSITIONAL
from toddle.failures import BadInput

if TYPE_CHECKING:
    from toddle.outside.seeing.camera_files import CameraFile
    from toddle.see.depth import Setting
    from toddle.see.pair import Ready
    from toddle.see.trouble import Watch
    from toddle.signals import DepthImage

_PROG = "toddle see depth"


@dataclass(frozen=True)
class Depth:
    """Depth from two pictures, or from two folders of pictures that belong together by their names.

    The first pair tells whether the pictures were rectified before, and what is still off is set right; the others
    follow it. Each pair leaves its depth in millimetres (a PNG of 16 bits, 0 where it can't be trusted) and in colours.

    Attributes:
        left: the left camera's picture, or the folder of them.
        right: the right camera's picture, or the folder of them.
        cameras: a calibration: a ROS camera_info pair (either file or the folder), OpenCV's YAML, Kalibr's camchain.
        setting: how depth is found; document is Huber's own.
        rectified: the pictures were rectified before (--no-rectified: they were not); unless given, they tell.
        straighten: set right what is still off; --no-straighten leaves it.
        period: time from one pair of a folder to the next [s]; trouble is looked for closely once a second.
        stages: draw every stage of the first pair, and what block size and weights do.
        out: the folder to leave; runs/depth unless given.
        json: print one JSON object with the figures, and nothing else.
    """

    left: Annotated[Path, POSITIONAL]
    right: Annotated[Path, POSITIONAL]
    cameras: Path
    setting: Literal["live", "best", "blocks", "quick", "document"] = "live"
    rectified: bool | None = None
    straighten: bool = True
    period: float = 0.2
    stages: bool = False
    out: Path | None = None
    json: bool = False


def main(argv: Sequence[str]) -> int:
    """Find depth, leave a folder, and return the exit code."""
    asked = parse(Depth, argv, prog=_PROG)
    if not 0 < asked.period <= 3600:
        raise BadInput(f"{asked.period:g} s is out of range", where="--period", remedy="give above 0, up to 3600 [s]")
    from toddle.cli.run_folder import new_folder
    from toddle.outside.files import write_json
    from toddle.outside.seeing.camera_files import read_cameras
    from toddle.see.depth import SETTINGS
    from toddle.see.pair import make_ready
    from toddle.see.rectify import rectification

    pairs = _pairs(asked)
    left, right = _read(pairs[0])
    file = read_cameras(asked.cameras, (left.shape[1], left.shape[0]))
    ready = make_ready(
        left, right, rectification(file.cameras), earlier=file.earlier, rectified=asked.rectified,
        straighten=asked.straighten,
    )  # fmt: skip
    setting = SETTINGS[asked.setting]
    _one(ready, ready.left, ready.right, setting)  # too small pictures are refused before anything is written
    folder = new_folder(asked.out, "depth")
    figures, watch = _all(asked, pairs, ready, setting, folder)
    figures |= {"setting": asked.setting, **_of_pair(ready, asked), "trouble": [*ready.trouble, *watch.trouble]}
    write_json(folder / "figures.json", figures)
    if asked.stages:
        _draw(folder, (left, right), file, ready, setting)
    _tell(figures, folder, as_json=asked.json)
    return 0


def _pairs(asked: Depth) -> list[tuple[str, Path, Path]]:
    """Name, left and right picture of each pair."""
    from toddle.outside.seeing.picture_files import paired

    if asked.left.is_dir() != asked.right.is_dir():
        raise BadInput("one is a folder, the other is not", where=_PROG, remedy="give two pictures or two folders")
    return list(paired(asked.left, asked.right).pairs) if asked.left.is_dir() else [("", asked.left, asked.right)]


def _read(pair: tuple[str, Path, Path], shape: tuple[int, ...] | None = None) -> tuple[Any, Any]:
    """Both pictures, of one size."""
    from toddle.outside.seeing.picture_files import read_picture

    left, right = read_picture(pair[1]), read_picture(pair[2])
    for picture, path in ((left, pair[1]), (right, pair[2])):
        wanted = shape or left.shape
        if picture.shape != wanted:
            what = f"{picture.shape[1]} x {picture.shape[0]} pixels, not {wanted[1]} x {wanted[0]} as the others"
            raise BadInput(what, where=str(path), remedy="give pictures of one size")
    return left, right


def _all(
    asked: Depth, pairs: list[tuple[str, Path, Path]], ready: Ready, setting: Setting, folder: Path
) -> tuple[dict[str, Any], Watch]:
    """Depth of every pair: what comes out, and what was noticed."""
    from toddle.outside.seeing.depth_pictures import write_depth
    from toddle.outside.terminal import Reporter
    from toddle.see.rectify import rectify
    from toddle.see.trouble import Watch, watch

    seen, each, spent = Watch(), {}, []
    with Reporter("pairs of pictures", len(pairs), quiet=asked.json or len(pairs) == 1) as reporter:
        for number, pair in enumerate(pairs):
            given = _read(pair, ready.left.shape)
            left, right = (
                one if maps is None else rectify(maps, one) for one, maps in zip(given, ready.maps, strict=True)
            )
            start = time.perf_counter()
            image = _one(ready, left, right, setting)
            spent.append(1000 * (time.perf_counter() - start))
            seen = watch(seen, left, right, image, number * asked.period)
            name = pair[0] or "pair"
            write_depth(folder, f"{pair[0]}_" if pair[0] else "", image)
            each[name] = _of_image(image)
            reporter.tell(number + 1, name)
    if len(pairs) == 1:
        only = next(iter(each.values()))
        seen = seen._replace(trouble=tuple(dict.fromkeys((*only["trouble"], *seen.trouble))))
        return {"pairs": 1, "milliseconds": min(spent), **only}, seen
    return {
        "pairs": len(pairs), "milliseconds": sorted(spent)[len(spent) // 2],
        "trusted_share": sum(one["trusted_share"] for one in each.values()) / len(each), "each": each,
    }, seen  # fmt: skip


def _one(ready: Ready, left: Any, right: Any, setting: Setting) -> DepthImage:
    from toddle.see.depth import depth_of
    from toddle.see.straighten import grey

    return depth_of(grey(left), grey(right), ready.cameras, setting, seen=ready.seen[0])


def _of_image(image: DepthImage) -> dict[str, Any]:
    """What a depth image tells."""
    import numpy as np

    there = image.depth[image.valid]
    told = [float(np.percentile(there, share)) for share in (1, 50, 99)] if len(there) else [float("nan")] * 3
    return {
        "trusted_share": float(image.valid.mean()), "depth_p1_m": told[0], "depth_median_m": told[1],
        "depth_p99_m": told[2], "trouble": list(image.trouble),
    }  # fmt: skip


def _of_pair(ready: Ready, asked: Depth) -> dict[str, Any]:
    """How the first pair was made ready."""
    before = ready.verdict.rectified if asked.rectified is None else asked.rectified
    rows = None if ready.off is None else ready.off.median
    after = None if ready.off is None or not ready.straightened else ready.off.median_after
    camera = ready.cameras.camera
    return {
        "rectified_before": before, "straightened": ready.straightened, "rows_apart_median_px": rows,
        "unseen_rows_apart_median_px": after, "focal_px": camera.fx, "baseline_m": ready.cameras.baseline,
    }  # fmt: skip


def _draw(folder: Path, given: tuple[Any, Any], file: CameraFile, ready: Ready, setting: Setting) -> None:
    """Every stage."""
    import numpy as np

    from toddle.outside.seeing.depth_pictures import write_stages
    from toddle.see.rectify import maps_of, rectify

    undistorted = given
    if ready.maps[0] is not None:
        pair = zip((file.cameras.left, file.cameras.right), given, strict=True)
        both = [rectify(maps_of(camera, np.eye(3), camera), picture) for camera, picture in pair]
        undistorted = (both[0], both[1])
    write_stages(folder, given, undistorted, ready, setting)


def _tell(figures: dict[str, Any], folder: Path, *, as_json: bool) -> None:
    """Print the figures: one JSON object, or a table; what is wrong goes to the error output."""
    from toddle.cli.see_calibrate import shown
    from toddle.outside.files import finite
    from toddle.outside.terminal import print_table

    if as_json:
        print(json.dumps(finite({**figures, "folder": str(folder)})))
    else:
        rows = [
            [key.replace("_", " "), shown(value)] for key, value in figures.items() if key not in ("each", "trouble")
        ]
        print_table("depth", ("", "these pictures"), rows)
        print(f"depth, figures and pictures: {folder}")
    for said in figures["trouble"]:
        print(f"toddle: {said}", file=sys.stderr)
