"""``toddle reach [ROBOT] --from movements.csv``: learning from recorded movements, with no simulation at all."""

from __future__ import annotations

import sys
import time
from dataclasses import replace
from pathlib import Path

from toddle.cli.body_folder import leave
from toddle.cli.reach import Reach
from toddle.cli.reach_body import after, refuse_files, tell_notes
from toddle.cli.run_folder import new_folder, refuse_used, tell_figures
from toddle.failures import BadInput


def learn_from_log(asked: Reach) -> int:
    """Learn from a file of movements, leave a folder, and return the exit code."""
    from toddle.outside.movement_log import read_movements
    from toddle.outside.skills import save
    from toddle.reach.recorded import learn_recorded
    from toddle.robots.catalogue import Choice, load_choice, settled
    from toddle.robots.chain import Chain

    begun, log_path = time.perf_counter(), asked.from_
    refuse_used(asked.out)
    refuse_files(asked)
    source = settled(Choice(asked.robot or "", asked.tip, asked.base, asked.joints))
    described = load_choice(source) if asked.robot is not None else None
    if described is not None and not isinstance(described, Chain):
        raise BadInput("a soft arm has no links to correct", where=source.spec, remedy="give --no-model")
    if described is not None:
        tell_notes(described, source.called)
    wanted = described.joints if described is not None else asked.joints
    log = read_movements(log_path or "", wanted)
    name = source.called or Path(log_path or "").stem

    def tell(news: str) -> None:
        print(f"{name}: {news}", file=sys.stderr)

    for note in log.notes:
        tell(note)
    found = learn_recorded(
        log.experience, log.joints, source, described=described, method=asked.method, seed=asked.seed or 0,
        where=str(log_path), tell=tell,
    )  # fmt: skip
    skill = found.skill
    folder = new_folder(asked.out, name)
    save(skill, folder)
    leave(folder, skill)
    figures = {**skill.figures, "total_seconds": time.perf_counter() - begun}
    if found.report:
        figures["changes"] = list(found.report)
    skill = replace(skill, figures=figures)
    if not asked.json:
        print("\n".join(found.report))
    after(asked, skill)
    tell_figures(skill, folder, as_json=asked.json)
    return 0
