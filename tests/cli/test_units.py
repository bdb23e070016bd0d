import math

import pytest

from toddle.cli.units import metres, sight
from toddle.failures import BadInput


@pytest.mark.parametrize(
    ("words", "seen"),
    [
        (("1mm",), (1e-3, 0.0)),
        (("5mrad",), (0.0, 5e-3)),
        (("1mm", "5mrad"), (1e-3, 5e-3)),
        (("5mrad,0.5cm",), (5e-3, 5e-3)),
        (("0mm",), (0.0, 0.0)),
        (("1deg",), (0.0, math.pi / 180)),
        (None, (0.0, 0.0)),
    ],
)
def test_noise_is_told_by_its_unit(words, seen):
    assert sight(words, "--noise") == pytest.approx(seen)


@pytest.mark.parametrize(
    "words", [("1",), ("mm",), ("1km",), ("-1mm",), ("2m",), ("1mm", "1cm"), ("nan mm",), ("1e9mm",)]
)
def test_what_is_no_noise_is_refused(words):
    with pytest.raises(BadInput, match="--noise"):
        sight(words, "--noise")


def test_a_length_alone():
    assert metres(("2mm",), "--look-noise") == pytest.approx(2e-3)
    with pytest.raises(BadInput, match="a length alone"):
        metres(("2mrad",), "--look-noise")
