"""simd and rapier, in the process of the bench binary `peers`."""

import copy
import json
import subprocess
from statistics import harmonic_mean


class Worker:
    """The binary, with these scenes."""

    def __init__(self, binary, scenes, folder):
        self.binary, self.listing = binary, folder / "scenes.json"
        self.listing.write_text(json.dumps([scene.request() for scene in scenes], indent=1))
        self.start()

    def start(self):
        pipes = {"stdin": subprocess.PIPE, "stdout": subprocess.PIPE, "text": True}
        self.process = subprocess.Popen([self.binary, str(self.listing)], **pipes)

    def another(self):
        """Another process, with the same scenes."""
        other = copy.copy(self)
        other.start()
        return other

    def ask(self, line):
        self.send(line)
        return self.receive(line)

    def send(self, line):
        self.process.stdin.write(line + "\n")
        self.process.stdin.flush()

    def receive(self, line):
        answer = self.process.stdout.readline()
        if not answer:
            raise RuntimeError(f"the worker ended at {line!r}")
        return json.loads(answer)

    def joints(self, scene):
        """Name, position, gains and effort of each joint that moves."""
        return self.ask(f"joints {scene}")

    def engine(self, name, scene):
        """Returns a function that steps a scene: from a number of steps to seconds and the largest error."""
        def batch(steps):
            answer = self.ask(f"{name} {scene} {steps}")
            return answer["seconds"], answer["error"]
        return batch

    def engine_beside(self, other, name, scene):
        """Returns such a function while another process steps such a scene too. The time is one scene's, at
        the mean speed of both."""
        def batch(steps):
            line = f"{name} {scene} {steps}"
            both = [self, other]
            for worker in both:
                worker.send(line)
            answers = [worker.receive(line) for worker in both]
            return harmonic_mean(of["seconds"] for of in answers), max(of["error"] for of in answers)
        return batch

    def close(self):
        self.process.stdin.close()
        self.process.wait()
