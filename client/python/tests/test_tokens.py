"""A daemon that requires tokens."""

from __future__ import annotations

import hashlib
from collections.abc import Iterator
from pathlib import Path

import pytest
from daemon import ASSETS, Daemon

import simd_client
import simd_client.aio
import simd_client.pybullet as p
from simd_client import RoleTooLow, Unauthenticated

VIEWER, OPERATOR, ADMIN, UNKNOWN = (f"simd_{digit * 64}" for digit in "1234")


@pytest.fixture(scope="module")
def daemon(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Daemon]:
    tokens = tmp_path_factory.mktemp("tokens") / "tokens"
    tokens.touch(mode=0o600)
    roles = {"viewer": VIEWER, "operator": OPERATOR, "admin": ADMIN}
    lines = [f"{role} {role} {hashlib.sha256(token.encode()).hexdigest()} never" for role, token in roles.items()]
    tokens.write_text("\n".join(lines))
    with Daemon("--paused", "--tokens", str(tokens), name="guarded") as running:
        with simd_client.connect(running.endpoint, token=ADMIN) as admin:
            admin.load(ASSETS / "Bench_Arm-1.2 rev B", name="arm", fixed=True)
        yield running


def test_a_token_allows_what_its_role_does(daemon: Daemon) -> None:
    with simd_client.connect(daemon.endpoint, token=VIEWER) as sim:
        arm = sim.robot("arm")
        assert arm.read().position.shape == (1,)
        with pytest.raises(RoleTooLow, match="the token of viewer has the role viewer"):
            arm.set_positions({"shoulder": 0.5})
        with pytest.raises(RoleTooLow, match="needs the role admin"):
            sim.step(1)
    with simd_client.connect(daemon.endpoint, token=OPERATOR) as sim:
        sim.robot("arm").set_positions({"shoulder": 0.5})
        with pytest.raises(RoleTooLow):
            sim.robot("arm").delete()


def test_without_a_token_of_the_daemon_nothing_is_answered(
    daemon: Daemon, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.delenv("SIMD_TOKEN", raising=False)
    with pytest.raises(Unauthenticated, match="set SIMD_TOKEN"):
        simd_client.connect(daemon.endpoint)
    with pytest.raises(Unauthenticated, match="unknown, or was revoked"):
        simd_client.connect(daemon.endpoint, token=UNKNOWN)
    with pytest.raises(ValueError, match="characters"):
        simd_client.connect(daemon.endpoint, token="simd\nsimd-client: else")
    with pytest.raises(p.error, match="asks for a token"):
        p.connect(p.DIRECT, options=f"--endpoint={daemon.endpoint}")


async def test_the_token_of_the_environment_is_taken_everywhere(
    daemon: Daemon, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("SIMD_TOKEN", ADMIN)
    async with simd_client.aio.connect(daemon.endpoint) as connected:
        await connected.step(1)
    with pytest.raises(RoleTooLow):
        async with simd_client.aio.connect(daemon.endpoint, token=VIEWER) as connected:
            await connected.step(1)
    number = p.connect(p.DIRECT, options=f"--endpoint={daemon.endpoint}")
    assert number >= 0
    p.disconnect(number)


def test_a_token_is_not_in_what_is_printed(daemon: Daemon, tmp_path: Path) -> None:
    with simd_client.connect(daemon.endpoint, token=ADMIN) as sim:
        assert ADMIN not in repr(sim) and ADMIN not in str(vars(sim))
