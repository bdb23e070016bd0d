"""The campaign that proves the walker, in physics, part by part.

    python -m benchmarks.walking                        # all parts; what was done before is kept
    python -m benchmarks.walking walks pushes           # some
    python -m benchmarks.walking --quick                # a taste of each, into runs/walking-quick
    python -m benchmarks.walking report                 # only the tables of docs/walking-proof.md, and the push map

Each part leaves walking_PART.json in the folder of results. From the root of the repository.
"""

from __future__ import annotations

import argparse
from pathlib import Path

from benchmarks.walking import deadline, obstacles, pushes, walks
from benchmarks.walking.campaign import run_part, single_threaded

PARTS = {part.name: part for module in (walks, obstacles, pushes, deadline) for part in module.PARTS}
REPORT = "report"
ROOT = Path(__file__).parents[2]


def main() -> None:
    parser = argparse.ArgumentParser(
        "python -m benchmarks.walking", description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("parts", nargs="*", metavar="PART", help=", ".join(PARTS))
    parser.add_argument("--workers", type=int, default=2)
    parser.add_argument("--quick", action="store_true", help="few cases, short walks")
    parser.add_argument("--again", action="store_true", help="don't keep what was done before")
    parser.add_argument("--out", type=Path, default=None, help="folder of the results")
    asked = parser.parse_args()
    for name in set(asked.parts) - {*PARTS, REPORT}:
        parser.error(f"no part named {name!r}; there are {', '.join(PARTS)}, and {REPORT}")
    quick_out = ROOT / "runs" / "walking-quick"
    out = asked.out or (quick_out if asked.quick else ROOT / "benchmarks" / "results")
    out.mkdir(parents=True, exist_ok=True)
    single_threaded()
    failed = False
    for name in asked.parts or PARTS:
        if name != REPORT:
            options = " --quick" if asked.quick else ""
            command = f"python -m benchmarks.walking {name}{options} --workers {asked.workers}"
            content = run_part(
                PARTS[name], out, workers=asked.workers, quick=asked.quick, again=asked.again, command=command
            )
            failed |= bool(content["failed"])
    if not asked.quick:
        from benchmarks.walking.report import write_report

        write_report(out, ROOT / "docs")
    raise SystemExit(failed)


if __name__ == "__main__":
    main()
