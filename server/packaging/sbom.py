"""Software bill of materials of the packages: CycloneDX 1.6, as JSON."""

from __future__ import annotations

import uuid
from datetime import UTC, datetime
from pathlib import Path

import licences
from cyclonedx.factory.license import LicenseFactory
from cyclonedx.model.bom import Bom
from cyclonedx.model.component import Component, ComponentType
from cyclonedx.output.json import JsonV1Dot6
from packageurl import PackageURL
from release import Release, run


def make(release: Release, commit: str) -> Path:
    """Writes the crates and the page's packages that the programs contain. Equal commits have equal bytes."""
    licence = LicenseFactory()
    root = Component(
        type=ComponentType.APPLICATION,
        name="simd",
        version=release.version,
        bom_ref="simd",
        licenses=[licence.make_from_string("Apache-2.0")],
    )
    bom = Bom(serial_number=uuid.uuid5(uuid.NAMESPACE_OID, f"simd {release.version} {commit}"))
    bom.metadata.component = root
    bom.metadata.timestamp = datetime.fromtimestamp(release.time, UTC)
    parts: list[Component] = []
    for package in licences.packages():
        url = PackageURL(package.kind, None, package.name, package.version) if package.kind else None
        part = Component(
            type=ComponentType.LIBRARY,
            name=package.name,
            version=package.version,
            purl=url,
            bom_ref=str(url or package.name),
            licenses=[licence.make_from_string(package.licence.replace("/", " OR "))],
        )
        bom.components.add(part)
        parts.append(part)
    bom.register_dependency(root, parts)
    path = release.to / f"simd-{release.version}.cdx.json"
    path.write_text(JsonV1Dot6(bom).output_as_string(indent=1) + "\n")
    return path


def commit() -> str:
    """Returns the commit of the repository, shortened."""
    return run("git", "rev-parse", "--short=12", "HEAD").strip()
