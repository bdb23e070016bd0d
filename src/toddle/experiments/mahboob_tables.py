"""Tables C.1 to C.21 of Mahboob 2015: mean and deviation of the test error for 280 combinations of parameters.

The numbers stand in ``documents/mahboob2015_tables_c.csv`` as printed. Two of them are misprints, read thus: table
C.14 prints a mean of 0.883950 for 2 hidden units, where its neighbours (0.1726 and 0.0673) and its deviation (0.0189)
ask for 0.088395; the rows of table C.8 say learning rate 0.07 and its caption 0.7: the rows are taken.
"""

from __future__ import annotations

import csv
from dataclasses import dataclass, replace
from importlib import resources

_LARGEST = 0.5  # [m]; no mean of the tables comes near it but the misprint


@dataclass(frozen=True)
class Cell:
    """A row of the tables.

    Attributes:
        table: its name in the document.
        hidden: units of the hidden layer; 0: none.
        learning_rate: alpha.
        perturbation: E.
        mean, std: the document's, over the testing cycles [m].
    """

    table: str
    hidden: int
    learning_rate: float
    perturbation: float
    mean: float
    std: float


def cells() -> tuple[Cell, ...]:
    """All rows of tables C.1 to C.21, the misprint of C.14 mended."""
    file = resources.files("toddle.experiments") / "documents" / "mahboob2015_tables_c.csv"
    printed = [
        Cell(r["table"], int(r["hidden"]), *(float(r[k]) for k in ("learning_rate", "perturbation", "mean_m", "std_m")))
        for r in csv.DictReader(file.read_text().splitlines())
    ]
    return tuple(replace(cell, mean=cell.mean / 10) if cell.mean > _LARGEST else cell for cell in printed)
