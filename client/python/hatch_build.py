"""Generates `simd_client.proto` from the schema when the package is built or installed."""

import re
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path
from typing import Any

from hatchling.builders.hooks.plugin.interface import BuildHookInterface

HEADER = '"""{what} Generated from the schema `simd.v1`; do not edit."""\n\n'


class GenerateProto(BuildHookInterface):
    """Runs protoc, which grpcio-tools brings as a wheel."""

    PLUGIN_NAME = "custom"

    def initialize(self, version: str, build_data: dict[str, Any]) -> None:
        """For wheels and editable installs; a source archive holds the schema itself."""
        if self.target_name == "wheel":
            generate(Path(self.root))


def generate(root: Path) -> None:
    """Writes the package `simd_client.proto` again."""
    # A source archive has the schema next to it, the repository in a folder that all clients share.
    shared = root.parent.parent / "proto"
    own = root / "schema"
    schema = own if (own / "simd").is_dir() else shared
    if not (schema / "simd" / "v1").is_dir():
        raise SystemExit(f"no schema simd/v1 in {own} or {shared}")
    files = sorted((schema / "simd" / "v1").glob("*.proto"))
    with tempfile.TemporaryDirectory() as scratch:
        out = Path(scratch) / "out"
        out.mkdir()
        descriptors = Path(scratch) / "descriptors"
        subprocess.run(
            [
                sys.executable,
                "-m",
                "grpc_tools.protoc",
                f"-I{schema}",
                f"-I{own}",
                f"--python_out={out}",
                f"--pyi_out={out}",
                f"--descriptor_set_out={descriptors}",
                *map(str, files),
                str(own / "simd_client" / "status.proto"),
            ],
            check=True,
        )
        package = Path(scratch) / "package"
        package.mkdir()
        for generated in sorted(out.rglob("*_pb2.py*")):
            (package / generated.name).write_text(moved(generated.read_text()))
        messages, enums, methods = contents(descriptors.read_bytes())
        write_tables(package, messages, enums, methods)
        target = root / "src" / "simd_client" / "proto"
        shutil.rmtree(target, ignore_errors=True)
        shutil.copytree(package, target)


def moved(code: str) -> str:
    """protoc imports by the schema's folders, which are not those of this package."""
    code = re.sub(r"^from simd\.v1 import ", "from simd_client.proto import ", code, flags=re.MULTILINE)
    # And pickles by the name of the module that a message says it is of.
    return re.sub(r"(?<=\(DESCRIPTOR, ')[\w.]*?(?=\w+_pb2')", "simd_client.proto.", code)


def contents(descriptors: bytes) -> tuple[dict[str, list[str]], dict[str, list[str]], dict[str, list[str]]]:
    """Messages and enums by module, and methods by service, of `simd.v1`."""
    from google.protobuf import descriptor_pb2

    messages: dict[str, list[str]] = {}
    enums: dict[str, list[str]] = {}
    methods: dict[str, list[str]] = {}
    for file in descriptor_pb2.FileDescriptorSet.FromString(descriptors).file:
        if file.package != "simd.v1":
            continue
        module = Path(file.name).stem + "_pb2"
        messages[module] = [message.name for message in file.message_type]
        enums[module] = [enum.name for enum in file.enum_type]
        for service in file.service:
            for method in service.method:
                request, reply = (name.rsplit(".", 1)[1] for name in (method.input_type, method.output_type))
                where = f"{module}:{service.name}:{method.name}:{request}:{reply}"
                methods.setdefault(service.name, []).append(where)
    return messages, enums, methods


def write_tables(
    package: Path,
    messages: dict[str, list[str]],
    enums: dict[str, list[str]],
    methods: dict[str, list[str]],
) -> None:
    """The names of the whole schema in one place, and its methods with their types."""
    names = HEADER.format(what="The messages of simd.v1.")
    for module, own in sorted(messages.items()):
        for name in sorted(own + enums[module]):
            names += f"from simd_client.proto.{module} import {name} as {name}\n"
    (package / "__init__.py").write_text(names)

    table = HEADER.format(what="The methods of simd.v1, by service and name.")
    table += "from simd_client import proto\nfrom simd_client.method import Method\n"
    for service, rows in sorted(methods.items()):
        table += "\n"
        for row in rows:
            _, _, method, request, reply = row.split(":")
            table += f'{method} = Method("{service}/{method}", proto.{request}, proto.{reply})\n'
    (package / "methods.py").write_text(table)
