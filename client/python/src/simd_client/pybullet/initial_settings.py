"""Restores the settings of a world after a script that found it unused."""

from __future__ import annotations

import sys
from typing import TYPE_CHECKING, Any

from simd_client.proto import (
    Integrator,
    ListEntitiesRequest,
    Physics,
    SetPhysicsRequest,
    SurfaceCombination,
    methods,
)

from .errors import error

if TYPE_CHECKING:
    from collections.abc import Iterable

    from .world import World

_NAMES = ("gravity", "time_step", "substeps", "integrator", "surface_combination")

_SURFACES = {
    SurfaceCombination.SURFACE_COMBINATION_MIN: "the smaller of two",
    SurfaceCombination.SURFACE_COMBINATION_MULTIPLY: "products of",
    SurfaceCombination.SURFACE_COMBINATION_MAX: "the larger of two",
}

_METHODS = {Integrator.INTEGRATOR_EULER: "Euler", Integrator.INTEGRATOR_BULLET: "Bullet's laws"}


def restore(world: World, found: tuple[Physics, bool] | None) -> None:
    """Restores the settings that a script found, and whether the world played; `None` for the guest of
    others. If remaining robots depend on the script's settings, it reports the settings that stay."""
    if found is None:
        return
    ours, (before, played) = world.physics, found
    try:
        world.read_state()
    except error as problem:
        if problem.reason:
            raise
        # A daemon that has ended has no settings.
        return
    now = world.physics
    changed = differing(now, before)
    if world.wire.call(methods.ListEntities, ListEntitiesRequest()).entities:
        if changed:
            print(
                f"simd: {world.wire.endpoint} keeps the script's robots and settings: {_settings(now)}; before it had "
                f"{_settings(before)}. --remove-robots puts both back",
                file=sys.stderr,
            )
        return
    if changed:
        # Settings that another client has set since then stay.
        world.set_physics(settings(before, [name for name in changed if _value(now, name) == _value(ours, name)]))
    if played and not world.playing:
        world.play(True)


def differing(one: Physics, other: Physics) -> list[str]:
    """Returns names of the settings that a script changes and that differ."""
    return [name for name in _NAMES if _value(one, name) != _value(other, name)]


def settings(physics: Physics, names: Iterable[str]) -> SetPhysicsRequest:
    """Returns a change to these settings of a world."""
    request = SetPhysicsRequest()
    for name in names:
        if name == "gravity":
            request.gravity.CopyFrom(physics.gravity)
        else:
            setattr(request, name, getattr(physics, name))
        if name == "integrator" and physics.HasField("bullet_contacts"):
            request.bullet_contacts.CopyFrom(physics.bullet_contacts)
    return request


def _value(physics: Physics, name: str) -> Any:
    """Returns a setting; contacts belong to the integrator."""
    value = getattr(physics, name)
    return (value, physics.bullet_contacts) if name == "integrator" else value


def _settings(physics: Physics) -> str:
    g = physics.gravity
    parts = f", {physics.substeps} substeps" if physics.substeps > 1 else ""
    method = _METHODS.get(physics.integrator, "leapfrog")
    surfaces = _SURFACES.get(physics.surface_combination, "unknown")
    return (
        f"a time step of {physics.time_step:.6g} s{parts}, {method}, {surfaces} frictions and gravity "
        f"({g.x:g}, {g.y:g}, {g.z:g})"
    )
