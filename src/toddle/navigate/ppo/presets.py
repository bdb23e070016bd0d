"""Numbers that are known to work, by the name of what is learned with them."""

from __future__ import annotations

from toddle.navigate.ppo.config import PpoConfig

POINT = PpoConfig(
    steps=300_000,
    actors=16,
    horizon=128,
    minibatch=512,
    epochs=8,
    epsilon=0.2,
    c1=0.5,
    learning_rate=3e-3,
    hidden=(16, 32),
    activation="relu",
    bound="mean",
)
"""The document's point (Huber 2019, section 4.3.1); networks, epsilon, c1, M and K are the document's."""

GOAL = PpoConfig(
    steps=400_000,
    actors=64,
    horizon=32,
    minibatch=512,
    epochs=8,
    c2=0.0,
    learning_rate=1e-3,
)
"""The walker that goes to a goal (Huber 2019, section 4.3.2); 64-64 tanh, as there."""

OBSTACLES = PpoConfig(
    steps=3_000_000,
    actors=128,
    horizon=64,
    minibatch=1024,
    epochs=4,
    c2=0.0,
    learning_rate=1e-3,
    memory=64,
    sequence=16,
)
"""The same around obstacles and among people, with a range scan. Without a memory the likeliest action goes to and fro
on one spot in every 25th layout."""

PRESETS = {
    "point": POINT,
    "goal": GOAL,
    "obstacles": OBSTACLES,
    "people": OBSTACLES,
    "Pendulum-v1": PpoConfig(
        steps=150_000,
        actors=16,
        horizon=128,
        minibatch=256,
        epochs=10,
        gamma=0.9,
        learning_rate=2e-3,
        normalise_observations=False,
    ),
    "CartPole-v1": PpoConfig(
        steps=100_000, actors=16, horizon=128, minibatch=256, epochs=8, learning_rate=1e-3, normalise_observations=False
    ),
}
"""By the name of what is learned."""


def preset(name: str) -> PpoConfig:
    """The numbers for something to learn; for what nobody has tuned any, the usual ones.

    Args:
        name: of a task, or the id of a Gymnasium environment.
    """
    return PRESETS.get(name, PpoConfig())
