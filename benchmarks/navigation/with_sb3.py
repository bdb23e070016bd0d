"""Stable-Baselines3's PPO on the document's point, by the numbers it is told; runs in an environment of its own.

    python -m benchmarks.navigation.with_sb3 '{"config": {...}, "seed": 0, ...}'

It is given wide bounds for its actions, so that its noise goes where it points, as in the task; the actor's mean is
squashed by tanh, as the document's is. The environments are numpy's, in its own `DummyVecEnv`, without a monitor.
"""

# pyright: reportMissingImports=false

from __future__ import annotations

import json
import math
import sys
import time
from importlib.metadata import version
from typing import Any

import gymnasium
import numpy as np
import torch
from stable_baselines3 import PPO
from stable_baselines3.common.callbacks import BaseCallback
from stable_baselines3.common.policies import ActorCriticPolicy
from stable_baselines3.common.vec_env import DummyVecEnv, VecNormalize

from toddle.navigate.task import Outcome
from toddle.outside.navigation.gym_point import PointEnv

WIDE = 1000.0  # bound of an action; none is ever clipped


class TanhMean(ActorCriticPolicy):
    """The usual networks, and tanh behind the actor's mean."""

    def _build(self, lr_schedule: Any) -> None:
        super()._build(lr_schedule)
        self.action_net = torch.nn.Sequential(self.action_net, torch.nn.Tanh())


class Watch(BaseCallback):
    """Tests before each so many steps, off the clock, and stops once it is solved."""

    def __init__(self, asked: dict[str, Any]) -> None:
        super().__init__()
        self.asked, self.checks, self.spent, self.solved = asked, [], 0.0, False

    def _on_training_start(self) -> None:
        self.began = time.process_time()

    def _on_rollout_start(self) -> None:
        if self.num_timesteps and self.num_timesteps % self.asked["check_steps"] == 0:
            self.check()

    def _on_rollout_end(self) -> None:
        config = self.asked["config"]
        if config["c2_over_reward"]:
            mean = float(self.model.rollout_buffer.rewards.mean())
            self.model.ent_coef = config["c2"] / max(mean, config["least_reward"])

    def _on_step(self) -> bool:
        return not self.solved

    def check(self) -> None:
        """Test, off the clock."""
        seconds, began = time.process_time() - self.began - self.spent, time.process_time()
        wins, losses = tested(self.model, self.asked)
        self.checks.append({"steps": self.num_timesteps, "cpu_seconds": seconds, "wins": wins, "losses": losses})
        self.solved = wins >= self.asked["wins"] and losses == 0
        self.spent += time.process_time() - began


def tested(model: PPO, asked: dict[str, Any]) -> tuple[float, int]:
    """Mean wins of ten runs of 10,000 steps without noise, and all losses."""
    envs = [PointEnv() for _ in range(asked["test_runs"])]
    seen = np.stack([env.reset(seed=asked["test_seed"] + k)[0] for k, env in enumerate(envs)])
    won = lost = 0
    normalise = model.get_vec_normalize_env()
    for _ in range(asked["test_steps"]):
        shown = normalise.normalize_obs(seen) if normalise is not None else seen
        actions, _ = model.predict(shown, deterministic=True)
        for k, (env, action) in enumerate(zip(envs, actions, strict=True)):
            seen[k], _, terminated, _, info = env.step(action)
            won += info["outcome"] == Outcome.WON
            lost += info["outcome"] == Outcome.LOST
            if terminated:
                seen[k] = env.reset()[0]
    return won / asked["test_runs"], lost


def wide() -> PointEnv:
    env = PointEnv()
    env.action_space = gymnasium.spaces.Box(-WIDE, WIDE, (2,), np.float32)
    return env


def run(asked: dict[str, Any]) -> dict[str, Any]:
    torch.set_num_threads(1)
    config = asked["config"]
    venv: Any = DummyVecEnv([wide] * config["actors"])
    if config["normalise_observations"] or config["normalise_rewards"]:
        venv = VecNormalize(
            venv,
            norm_obs=config["normalise_observations"],
            norm_reward=config["normalise_rewards"],
            gamma=config["gamma"],
        )
    rate = config["learning_rate"]
    activation = {"relu": torch.nn.ReLU, "tanh": torch.nn.Tanh}[config["activation"]]
    model = PPO(
        TanhMean if config["bound"] == "mean" else ActorCriticPolicy,
        venv,
        learning_rate=(lambda left: rate * left) if config["schedule"] == "linear" else rate,
        n_steps=config["horizon"],
        batch_size=config["minibatch"],
        n_epochs=config["epochs"],
        gamma=config["gamma"],
        gae_lambda=config["lambda_"],
        clip_range=config["epsilon"],
        ent_coef=config["c2"],
        vf_coef=config["c1"],
        max_grad_norm=config["gradient_norm"],
        normalize_advantage=config["normalise_advantages"],
        policy_kwargs={
            "net_arch": config["hidden"],
            "activation_fn": activation,
            "log_std_init": math.log(config["deviation"]),
        },
        seed=asked["seed"],
        device="cpu",
    )
    watch = Watch(asked)
    model.learn(config["steps"], callback=watch)
    if not watch.solved and (not watch.checks or watch.checks[-1]["steps"] < model.num_timesteps):
        watch.check()
    return {"checks": watch.checks, "compile_seconds": 0.0, "version": version("stable-baselines3")}


if __name__ == "__main__":
    print(json.dumps(run(json.loads(sys.argv[1]))))
