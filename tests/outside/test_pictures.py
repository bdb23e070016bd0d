"""Pictures show the numbers they are given: read back from the figure's own artists, and from the file."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import matplotlib.image
import numpy as np
import pytest
from matplotlib.figure import Figure

from toddle.outside import pictures

RANDOM = np.random.default_rng(0)


@pytest.fixture
def drawn(monkeypatch: pytest.MonkeyPatch) -> list[Figure]:
    """The figures that were saved."""
    figures: list[Figure] = []
    save = pictures.save_figure

    def keep(figure: Figure, path: Path) -> None:
        figures.append(figure)
        save(figure, path)

    monkeypatch.setattr(pictures, "save_figure", keep)
    return figures


def test_error_over_samples_shows_both_sets_and_the_document(tmp_path: Path, drawn: list[Figure]) -> None:
    pictures.error_over_samples(
        tmp_path / "a.png",
        [100, 200, 300],
        [90.0, 50.0, 30.0],
        [80.0, 40.0, 20.0],
        title="t",
        published={"fixed_error_mm": 24.7},
    )
    axes = drawn[0].axes[0]
    lines = [np.asarray(line.get_ydata()).tolist() for line in axes.lines]
    assert lines == [[90, 50, 30], [80, 40, 20], [24.7, 24.7]]
    assert axes.get_ylim()[0] == 0
    legend = axes.get_legend()
    assert legend is not None
    assert [text.get_text() for text in legend.get_texts()] == [
        "fixed test set", "seen test set", "document, fixed: 24.7 mm",
    ]  # fmt: skip


@pytest.mark.parametrize("space", [2, 3])
def test_explored_space_has_a_dot_for_each_position(tmp_path: Path, drawn: list[Figure], space: int) -> None:
    seen = RANDOM.random((50, space))
    pictures.explored_space(tmp_path / "a.png", seen, np.zeros(space), title="explored")
    axes = drawn[0].axes[0]
    assert axes.get_title() == "explored"
    dots = axes.collections[0]
    shown = np.stack(dots._offsets3d, axis=1) if space == 3 else dots.get_offsets()  # pyright: ignore[reportAttributeAccessIssue]
    np.testing.assert_allclose(np.asarray(shown), seen)


@pytest.mark.parametrize("space", [2, 3])
def test_targets_are_coloured_by_their_errors_in_millimetres(tmp_path: Path, drawn: list[Figure], space: int) -> None:
    errors = RANDOM.random(20) / 10
    pictures.targets_by_error(tmp_path / "a.png", RANDOM.random((20, space)), errors, title="t")
    first = drawn[0].axes[0]
    bars = next(axes for axes in drawn[0].axes if axes.patches)
    np.testing.assert_allclose(np.asarray(first.collections[0].get_array()), 1000 * errors)
    np.testing.assert_allclose([bar.get_height() for bar in bars.patches], 1000 * errors)  # pyright: ignore[reportAttributeAccessIssue]


SOUND: list[Callable[[Path], None]] = [
    lambda path: pictures.error_over_samples(path, [1], [0.0], [0.0], title="one test"),
    lambda path: pictures.explored_space(path, np.zeros((1, 3)), np.zeros(3), title="one position"),
    lambda path: pictures.targets_by_error(path, np.zeros((1, 2)), np.zeros(1), title="one target, no error"),
]


@pytest.mark.parametrize("draw", SOUND)
def test_the_smallest_run_has_its_picture_and_it_is_not_blank(draw: Callable[[Path], None], tmp_path: Path) -> None:
    draw(tmp_path / "a.png")
    image = matplotlib.image.imread(tmp_path / "a.png")
    assert image.shape[0] > 300
    assert image.shape[1] > 300
    assert len(np.unique(image[::5, ::5, :3].reshape(-1, 3), axis=0)) > 5
    assert [entry.name for entry in tmp_path.iterdir()] == ["a.png"]
