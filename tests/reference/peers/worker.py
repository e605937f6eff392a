"""simd and rapier, in the process of the bench binary `peers`."""

import json
import subprocess


class Worker:
    """The binary, with these scenes."""

    def __init__(self, binary, scenes, folder):
        listing = folder / "scenes.json"
        listing.write_text(json.dumps([scene.request() for scene in scenes], indent=1))
        pipes = {"stdin": subprocess.PIPE, "stdout": subprocess.PIPE, "text": True}
        self.process = subprocess.Popen([binary, str(listing)], **pipes)

    def ask(self, line):
        self.process.stdin.write(line + "\n")
        self.process.stdin.flush()
        answer = self.process.stdout.readline()
        if not answer:
            raise RuntimeError(f"the worker ended at {line!r}")
        return json.loads(answer)

    def joints(self, scene):
        """Name, position, gains and effort of each joint that moves."""
        return self.ask(f"joints {scene}")

    def engine(self, name, scene):
        """What steps a scene: from a number of steps to seconds and the largest error."""
        def batch(steps):
            answer = self.ask(f"{name} {scene} {steps}")
            return answer["seconds"], answer["error"]
        return batch

    def close(self):
        self.process.stdin.close()
        self.process.wait()
