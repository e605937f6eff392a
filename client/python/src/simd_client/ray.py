"""Worlds on the machines of a Ray cluster: actors that hold them, and a map over these actors.

    import ray, simd_client
    from simd_client.ray import Worlds

    def arm():
        sim = simd_client.connect("embedded", config={"paused": True})
        sim.load("/shared/arm.urdf", "arm", fixed=True)
        return sim

    def fallen(sim, seed):
        return sim.rollout(100, copies=64, variations=variations, seed=seed).costs

    ray.init("auto")
    with Worlds(arm, 8) as worlds:
        costs = worlds.map(fallen, range(100))

Results have the same bits whatever the number of worlds, and a lost node's work is done elsewhere.
"""

from __future__ import annotations

import importlib
from collections import deque
from collections.abc import Callable, Iterable
from types import TracebackType
from typing import Any, Generic, TypeVar

from simd_client import extras
from simd_client.blocking.simulation import Simulation

__all__ = ["Worlds"]

Held = TypeVar("Held")
Item = TypeVar("Item")
Found = TypeVar("Found")

_OPTIONS: dict[str, Any] = {"num_cpus": 1, "scheduling_strategy": "SPREAD", "max_restarts": -1}


class Worlds(Generic[Held]):
    """Actors of Ray on the nodes of its cluster, each with a world of its process. Use it with `with`, which ends
    them."""

    def __init__(self, make: Callable[[], Held], count: int, **options: Any) -> None:
        """Starts `count` actors. Each calls `make` for what it holds: an embedded `Simulation`, or an environment of
        `simd_client.gymnasium`. `options` are those of Ray's actors, by default `num_cpus=1` and
        `scheduling_strategy="SPREAD"`.

        Raises `ImportError` without Ray.
        """
        if count < 1:
            raise ValueError(f"count={count}: at least one actor holds a world")
        self._ray = _ray()
        actor: Any = self._ray.remote(_Actor).options(**{**_OPTIONS, **options})
        self._actors: list[Any] = [actor.remote(make) for _ in range(count)]

    def map(self, function: Callable[[Held, Item], Found], items: Iterable[Item], *, tries: int = 4) -> list[Found]:
        """Calls `function` for each item, in any of the worlds, and returns the results in the order of the items.

        A world is as `make` returned it before each call, so the results do not depend on the number of worlds. An
        environment is not: the function calls its `reset` with a seed. If an actor is lost, another one does its
        item, and Ray starts the actor again on a node with free resources.

        Raises the function's exceptions. Raises Ray's error if no actor is left, or if an item was lost with
        `tries` actors.
        """
        errors: Any = self._ray.exceptions
        gone = (errors.RayActorError, errors.ObjectLostError, errors.NodeDiedError)
        code = self._ray.put(function)
        open_items = deque(enumerate(items))
        wanted = len(open_items)
        lost: dict[int, int] = {}
        found: dict[int, Found] = {}
        idle: list[Any] = []
        # Actors that were asked, by the reference of the answer: for an item, or for none if only whether they are ready.
        asked: dict[Any, tuple[Any, tuple[int, Item] | None]] = {_ready(actor): (actor, None) for actor in self._actors}
        while len(found) < wanted:
            (answer, *_), _ = self._ray.wait(list(asked))
            actor, task = asked.pop(answer)
            try:
                result = self._ray.get(answer)
            except gone as error:
                if task is not None:
                    lost[task[0]] = lost.get(task[0], 0) + 1
                    if lost[task[0]] == tries:
                        raise
                    open_items.appendleft(task)
                    asked[_ready(actor)] = actor, None
                else:
                    # Ray does not start it again.
                    self._actors.remove(actor)
                    if not self._actors:
                        raise error
            else:
                idle.append(actor)
                if task is not None:
                    found[task[0]] = result
            while idle and open_items:
                actor, task = idle.pop(), open_items.popleft()
                asked[actor.call.remote(code, task[1])] = actor, task
        return [found[index] for index in range(wanted)]

    def __len__(self) -> int:
        return len(self._actors)

    def close(self) -> None:
        """Ends the actors with their worlds."""
        for actor in self._actors:
            self._ray.kill(actor)
        self._actors = []

    def __enter__(self) -> Worlds[Held]:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()


class _Actor:
    """A world in a process of Ray."""

    def __init__(self, make: Callable[[], Any]) -> None:
        self._held = make()
        self._begin = self._held.save_state() if isinstance(self._held, Simulation) else None

    def ready(self) -> None:
        """Answers once the world is open."""

    def call(self, function: Callable[[Any, Any], Any], item: Any) -> Any:
        """Calls a function for an item."""
        if self._begin is not None:
            self._held.restore_state(self._begin)
        return function(self._held, item)


def _ready(actor: Any) -> Any:
    """Asks an actor whether it is ready. A lost one answers once Ray has started it again."""
    return actor.ready.options(max_task_retries=-1).remote()


def _ray() -> Any:
    try:
        return importlib.import_module("ray")
    except ImportError as missing:
        raise ImportError(f"worlds on other machines need Ray: {extras.RAY}") from missing
