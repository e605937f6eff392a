"""Several clients that step one world together."""

from __future__ import annotations

import threading

import pytest
from daemon import Daemon

import simd_client
from simd_client import InLockstep, LockstepMemberNotFound, Simulation


def test_two_clients_that_joined_step_the_world_together(sim: Simulation, daemon: Daemon) -> None:
    first = sim
    with simd_client.connect(daemon.endpoint) as second:
        first.pause()
        before = first.stamp.step
        with first.join_lockstep() as group, second.join_lockstep():
            assert [member.waits_for for member in group.members()] == [0, 0]
            with pytest.raises(InLockstep):
                first.play()
            reached: list[int] = []
            other = threading.Thread(target=lambda: reached.extend(second.step(4).stamp.step for _ in range(3)))
            other.start()
            reached_first = [first.step(4).stamp.step - before for _ in range(3)]
            other.join()
            assert reached_first == [4, 8, 12]
            assert [step - before for step in reached] == [4, 8, 12]
        # No member waits for clients that have left.
        assert first.step(1).stamp.step == before + 13


def test_a_member_that_does_not_ask_learns_so_and_steps_alone_after_it_left(sim: Simulation) -> None:
    sim.pause()
    member = sim.join_lockstep(timeout=0.02)
    while member.members():
        pass
    with pytest.raises(LockstepMemberNotFound):
        sim.step()
    with pytest.raises(LockstepMemberNotFound):
        member.leave()
    assert isinstance(sim.step(), simd_client.States)
