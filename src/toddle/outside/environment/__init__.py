"""The walker as a Gymnasium environment: importing this registers ``toddle/Walk-v0``.

    import gymnasium
    env = gymnasium.make("toddle.outside.environment:toddle/Walk-v0")   # imports and registers at once

Gymnasium 1 finds environments of other packages in no other way; what the environment needs is imported when one is
made.
"""

from __future__ import annotations

from gymnasium.envs.registration import register

WALK = "toddle/Walk-v0"
"""The id of the environment."""

register(id=WALK, entry_point="toddle.outside.environment.walk:WalkEnv")
