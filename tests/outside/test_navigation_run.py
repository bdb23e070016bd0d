"""Runs: to the end, stopped and taken up again bit for bit, into trouble; what they leave, what TensorBoard shows."""

from __future__ import annotations

import shutil
from dataclasses import replace
from pathlib import Path
from typing import Any

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest
from tensorboardX.proto import event_pb2
from tensorboardX.record_writer import masked_crc32c

from toddle.failures import BadInput
from toddle.navigate.policy import Policy
from toddle.navigate.ppo.config import PpoConfig
from toddle.navigate.ppo.training import Report, Training
from toddle.navigate.tasks.point import PointTask
from toddle.outside.navigation import ppo_course
from toddle.outside.navigation.learning_pictures import epochs, learning_curve
from toddle.outside.navigation.policy_files import load_policy
from toddle.outside.navigation.ppo_run import Plan, Run, run
from toddle.outside.navigation.training_files import load_training
from toddle.outside.terminal import Stop

TASK = PointTask(longest=20)
CONFIG = PpoConfig(steps=16 * 11, actors=4, horizon=4, minibatch=16, epochs=1, hidden=(3,), schedule="constant")


def plan(folder: Path, **changes: Any) -> Plan:
    """Of a short run."""
    return replace(Plan(folder, "point", {"task": "point"}, seed=3, saved_every=4, judged_every=3), **changes)


def bits(tree: Any) -> list[bytes]:
    """Of all leaves."""
    plain = [
        jax.random.key_data(x) if jnp.issubdtype(x.dtype, jax.dtypes.prng_key) else x for x in jax.tree.leaves(tree)
    ]
    return [np.asarray(x).tobytes() for x in plain]


class Asked:
    """A `Reporter` that asks to stop after so many steps."""

    def __init__(self, after: int = 10**9) -> None:
        self.after, self.stop, self.told = after, Stop(), list[tuple[int, str]]()

    def tell(self, done: int, news: str) -> None:
        """Listen."""
        self.told.append((done, news))
        self.stop.asked = done >= self.after


@pytest.fixture(scope="module")
def done(tmp_path_factory: pytest.TempPathFactory) -> Run:
    """A run to the end."""
    folder = tmp_path_factory.mktemp("whole")
    return run(TASK, CONFIG, plan(folder, source={"folder": str(folder)}))


def test_a_run_makes_all_updates(done: Run) -> None:
    assert CONFIG.updates == 11
    assert int(done.training.updates) == 11
    assert done.history["reward"].shape == (1, 11)
    assert done.history["steps"][0].tolist() == [16 * k for k in range(1, 12)]


def test_what_a_run_leaves(done: Run) -> None:
    folder = Path(done.policy.source["folder"])
    assert sorted(path.name for path in folder.iterdir()) == [
        "checkpoint.json", "checkpoints", "policy.json", "policy.safetensors", "tensorboard",
    ]  # fmt: skip
    found = load_policy(folder)
    assert bits((found.network, found.moments)) == bits((done.policy.network, done.policy.moments))
    figures = done.figures
    assert (figures["env"], figures["seed"], figures["steps"], figures["stopped"]) == ("point", 3, 176, None)
    assert figures["steps_per_second"] == pytest.approx(176 / figures["train_seconds"])
    assert figures["compile_seconds"] > 0
    assert found.figures == {**figures, "steps_per_second": found.figures["steps_per_second"]}
    assert (done.stopped, done.diverged) == (None, False)


@pytest.mark.parametrize("after", [1, 16 * 5, 16 * 8])
def test_a_run_that_was_stopped_goes_on_bit_for_bit(tmp_path: Path, done: Run, after: int) -> None:
    asked = Asked(after)
    first = run(TASK, CONFIG, plan(tmp_path), reporter=asked, stop=asked.stop)
    assert first.stopped == "it was asked to stop"
    assert not first.diverged
    assert 0 < first.figures["updates"] < 11
    second = run(TASK, CONFIG, plan(tmp_path, seed=8), resume=True)  # it knows its own seed
    assert second.figures["seed"] == 3
    assert bits(second.training) == bits(done.training)
    assert {k: v.tobytes() for k, v in second.history.items()} == {k: v.tobytes() for k, v in done.history.items()}
    assert second.figures["steps"] == 176
    assert second.figures["train_seconds"] > first.figures["train_seconds"]


def test_a_run_that_was_killed_goes_on_bit_for_bit(tmp_path: Path, done: Run) -> None:
    """It takes up the last checkpoint; event files of what was lost are hidden by those that come after."""

    class Dies(Asked):
        def tell(self, done: int, news: str) -> None:
            if done >= 16 * 6:
                raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        run(TASK, CONFIG, plan(tmp_path), reporter=Dies())
    template = jax.eval_shape(lambda: ppo_course.beginning(TASK, CONFIG, jnp.int32(0), 1))
    assert int(load_training(tmp_path, template).training.updates) == 4
    assert bits(run(TASK, CONFIG, plan(tmp_path), resume=True).training) == bits(done.training)


def test_a_finished_run_has_nothing_left_to_do(tmp_path: Path, done: Run) -> None:
    shutil.copytree(done.policy.source["folder"], tmp_path, dirs_exist_ok=True)
    again = run(TASK, CONFIG, plan(tmp_path), resume=True)
    assert bits(again.training) == bits(done.training)
    assert again.figures["train_seconds"] == done.figures["train_seconds"]


def test_other_numbers_are_refused(tmp_path: Path) -> None:
    asked = Asked(1)
    run(TASK, CONFIG, plan(tmp_path), reporter=asked, stop=asked.stop)
    with pytest.raises(BadInput, match="begun with other numbers"):
        run(TASK, replace(CONFIG, gamma=0.5), plan(tmp_path), resume=True)
    with pytest.raises(BadInput, match="there is no run here"):
        run(TASK, CONFIG, plan(tmp_path / "nowhere"), resume=True)
    with pytest.raises(BadInput, match="saved-every"):
        plan(tmp_path, saved_every=0)


@pytest.mark.parametrize(
    ("changes", "said"),
    [({"devices": 999}, "--devices"), ({"devices": 2, "seeds": 2}, "--devices"), ({"devices": 0}, "devices")],
)
def test_devices_that_are_not_there_are_refused(tmp_path: Path, changes: dict[str, int], said: str) -> None:
    with pytest.raises(BadInput, match=said):
        run(TASK, CONFIG, plan(tmp_path, **changes))


def test_the_best_policy_is_kept(tmp_path: Path) -> None:
    """A judge that likes the sixth update best; then the last policy isn't the one that is left."""
    seen: dict[int, Policy] = {}

    def judge(policy: Policy) -> dict[str, float]:
        number = 3 * (len(seen) + 1)
        seen[number] = policy
        return {"score": -abs(number - 6.0), "wins": number}

    found = run(TASK, CONFIG, plan(tmp_path), judge=judge)
    assert list(seen) == [3, 6, 9, 12]  # the last one after the eleventh
    assert bits((found.policy.network, found.policy.moments)) == bits((seen[6].network, seen[6].moments))
    assert bits(found.training.network) != bits(found.policy.network)
    assert (found.figures["best_update"], found.figures["judged"]) == (6, {"score": 0.0, "wins": 6})
    again = run(TASK, CONFIG, plan(tmp_path), judge=lambda policy: {"score": -9.0}, resume=True)
    assert bits(again.policy.network) == bits(seen[6].network)


def stepped(poison: int) -> ppo_course.Advance:
    """Updates one by one; after so many the losses are not finite."""

    def advance(training: Training) -> tuple[Training, Report]:
        after, reports = ppo_course.updates(TASK, CONFIG, 1, training, jnp.int32(1))
        report = jax.tree.map(lambda part: part[0], reports)
        if int(after.updates) < poison:
            return after, report
        return after._replace(network=jax.tree.map(lambda w: w * jnp.nan, after.network)), report._replace(
            value_loss=jnp.float32(jnp.nan)
        )

    return advance


def test_updates_that_are_made_elsewhere(tmp_path: Path, done: Run) -> None:
    begun = ppo_course.beginning(TASK, CONFIG, jnp.int32(3), 1)
    found = run(TASK, CONFIG, plan(tmp_path), advance=stepped(99), begun=begun)
    assert bits(found.training) == bits(done.training)
    with pytest.raises(BadInput, match="one seed"):
        run(TASK, CONFIG, plan(tmp_path, seeds=2), advance=stepped(99), begun=begun)


def test_a_diverging_run_stops_and_keeps_the_last_good_checkpoint(tmp_path: Path) -> None:
    begun = ppo_course.beginning(TASK, CONFIG, jnp.int32(3), 1)
    found = run(TASK, CONFIG, plan(tmp_path), advance=stepped(7), begun=begun)
    assert found.diverged
    assert "no longer finite" in (found.stopped or "")
    assert found.figures["stopped"] == found.stopped
    assert load_policy(tmp_path).figures["stopped"] == found.stopped
    saved = load_training(tmp_path, begun)
    assert int(saved.training.updates) == 4
    again = run(TASK, CONFIG, plan(tmp_path), resume=True)
    assert not again.diverged
    assert int(again.training.updates) == 11


def test_broken_networks_are_noticed_before_they_are_used(tmp_path: Path) -> None:
    begun = ppo_course.beginning(TASK, CONFIG, jnp.int32(3), 1)

    def advance(training: Training) -> tuple[Training, Report]:
        after, report = stepped(99)(training)
        if int(after.updates) == 4:
            after = after._replace(network=jax.tree.map(lambda w: w * jnp.nan, after.network))
        return after, report

    found = run(TASK, CONFIG, plan(tmp_path), advance=advance, begun=begun)
    assert "networks are no longer finite" in (found.stopped or "")
    assert found.figures["updates"] == 4
    assert 0 < int(found.training.updates) < 4
    assert bits(load_policy(tmp_path).network) == bits(found.training.network)


def test_a_seed_in_trouble_does_not_stop_the_others(tmp_path: Path) -> None:
    begun = ppo_course.beginning(TASK, CONFIG, jnp.int32(3), 2)
    huge = begun.network.critic.biases[-1].at[1].set(3e38)
    begun = begun._replace(network=eqx.tree_at(lambda network: network.critic.biases[-1], begun.network, huge))
    found = run(TASK, CONFIG, plan(tmp_path, seeds=2, saved_every=100), begun=begun, judge=lambda _: {"score": 1.0})
    assert (found.diverged, found.stopped) == (False, None)
    assert found.figures["troubles"][0] is None
    assert "finite" in found.figures["troubles"][1]
    assert found.figures["steps"] == 2 * 176
    assert found.training.updates.tolist() == [11, 0]
    assert found.history["reward"].shape == (2, 11)
    assert np.isfinite(found.history["reward"][0]).all()
    assert np.isnan(found.history["reward"][1, 1:]).all()
    both = [load_policy(tmp_path / name) for name in ("seed-3", "seed-4")]
    assert [one.figures["seed"] for one in both] == [3, 4]
    assert "best_update" in both[0].figures
    assert "best_update" not in both[1].figures


def test_several_seeds_go_on_bit_for_bit(tmp_path: Path, done: Run) -> None:
    both = run(TASK, CONFIG, plan(tmp_path / "whole", seeds=2))
    np.testing.assert_allclose(both.history["reward"][:1], done.history["reward"], rtol=1e-3, atol=1e-5)
    asked = Asked(16 * 5)
    run(TASK, CONFIG, plan(tmp_path / "cut", seeds=2), reporter=asked, stop=asked.stop)
    again = run(TASK, CONFIG, plan(tmp_path / "cut"), resume=True)
    assert bits(again.training) == bits(both.training)
    assert len(again.policies) == 2
    assert bits(again.policies[0].network) != bits(again.policies[1].network)


def events(folder: Path) -> list[Any]:
    """All events of a folder's files, in order; their checksums hold."""
    found = []
    for path in sorted(folder.iterdir()):
        content = path.read_bytes()
        while content:
            length = int.from_bytes(content[:8], "little")
            assert masked_crc32c(content[:8]) == int.from_bytes(content[8:12], "little")
            event = event_pb2.Event()  # pyright: ignore[reportAttributeAccessIssue]
            event.ParseFromString(content[12 : 12 + length])
            found.append(event)
            content = content[16 + length :]
    return found


def test_tensorboard_shows_the_history(done: Run) -> None:
    found = events(Path(done.policy.source["folder"]) / "tensorboard")
    told = {(value.tag, event.step): value.simple_value for event in found for value in event.summary.value}
    for name, tag in (("reward", "step/reward"), ("entropy", "policy/entropy"), ("gradient", "learning/gradient")):
        rows = done.history[name][0].tolist()
        assert [told[tag, 16 * (k + 1)] for k in range(11)] == rows
    episodes = done.history["episodes"][0]
    assert {step for tag, step in told if tag == "episode/return"} == {16 * (k + 1) for k in np.flatnonzero(episodes)}
    assert all(np.isfinite(value) for value in told.values())


def test_what_was_lost_is_hidden_on_tensorboard(tmp_path: Path) -> None:
    asked = Asked(16 * 3)
    run(TASK, CONFIG, plan(tmp_path), reporter=asked, stop=asked.stop)
    run(TASK, CONFIG, plan(tmp_path), resume=True)
    starts = [event.step for event in events(tmp_path / "tensorboard") if event.HasField("session_log")]
    assert len(starts) == 1
    assert starts[0] % 16 == 1


def test_progress_is_told(tmp_path: Path) -> None:
    asked = Asked()
    run(TASK, CONFIG, plan(tmp_path), reporter=asked)
    assert asked.told[-1][0] == 176
    assert "steps/s" in asked.told[-1][1]


def test_epochs_of_another_length_than_updates() -> None:
    """Updates of 4 steps of reward 1, 2, 3 each; epochs of 6 hold 4 + 2 x 2 and 2 x 2 + 4 x 3."""
    history = {
        "steps": np.array([[4, 8, 12], [4, 0, 0]]),
        "reward": np.array([[1.0, 2.0, 3.0], [1.0, np.nan, np.nan]]),
        "deviation": np.array([[1.0, 0.5, 0.1], [1.0, np.nan, np.nan]]),
    }
    found = epochs(history, 6)
    np.testing.assert_allclose(found.reward, [[8, 16], [np.nan, np.nan]])
    assert not found.discrete
    np.testing.assert_allclose(found.explored, [[0.75, 0.1], [np.nan, np.nan]])


@pytest.mark.parametrize(("seeds", "epoch"), [(1, None), (4, 10_000)])
@pytest.mark.parametrize("discrete", [True, False])
def test_curves_are_drawn(tmp_path: Path, seeds: int, epoch: int | None, discrete: bool) -> None:
    rng, updates = np.random.default_rng(0), 122
    history = {
        "steps": np.tile(4096 * np.arange(1, updates + 1), (seeds, 1)),
        "reward": 0.3 * (1 - np.exp(-np.arange(updates) / 30)) + 0.01 * rng.normal(size=(seeds, updates)),
        "deviation": np.zeros((seeds, updates)) if discrete else np.linspace(0.5, 1, updates) * np.ones((seeds, 1)),
        "entropy": np.linspace(2, 0.1, updates) + 0.05 * rng.normal(size=(seeds, updates)),
    }
    history["steps"][-1, 90:] = 0
    history["reward"][-1, 90:] = np.nan
    learning_curve(tmp_path / "curve.png", history, title="the point", epoch=epoch, published=30.0 if epoch else None)
    assert (tmp_path / "curve.png").read_bytes().startswith(b"\x89PNG")
