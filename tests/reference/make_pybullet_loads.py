"""Writes pybullet_loads.json: the URDFs of PyBullet's data package that PyBullet loads."""

import json
import pathlib

import pybullet
import pybullet_data


def main() -> None:
    root = pathlib.Path(pybullet_data.getDataPath())
    pybullet.connect(pybullet.DIRECT)
    pybullet.setAdditionalSearchPath(str(root))
    refused, files = [], sorted(root.rglob("*.urdf"))
    for path in files:
        try:
            pybullet.loadURDF(str(path))
        except pybullet.error:
            refused.append(path.relative_to(root).as_posix())
        pybullet.resetSimulation()
    found = {"pybullet": "3.2.7", "files": len(files), "loaded": len(files) - len(refused), "refused": refused}
    pathlib.Path(__file__).with_name("pybullet_loads.json").write_text(json.dumps(found, indent=2) + "\n")


if __name__ == "__main__":
    main()
