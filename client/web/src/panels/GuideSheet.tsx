// How a robot comes into the world, for who opens the page for the first time.
import type { JSX } from "preact";
import { guideOpen } from "./guide-open";
import { loadCommand, simctl } from "./load-command";
import { Sheet } from "./Sheet";

/** Rendered only while it is open. */
export function GuideSheet(): JSX.Element | null {
  if (!guideOpen.value) return null;
  return (
    <Sheet
      title="How to begin"
      testId="guide-sheet"
      onClose={() => {
        guideOpen.value = false;
      }}
    >
      <div class="guide">
        <h3>Load a robot</h3>
        <p>
          Drop its folder on the page, or choose it: the description (URDF, xacro, SDF or MJCF) with its meshes. The page finds the meshes by the rules of ROS (<code>package://</code> and relative paths), and
          the load report says what is missing or was repaired. What is dropped has a fixed base; <code>simctl</code> has all options.
        </p>
        <pre>
          <code>{loadCommand(location.host)}</code>
        </pre>
        <h3>Give it ground</h3>
        <p>The grid is only drawn. Free robots need something to stand on: “add ground” below the picture adds a plane, as this does:</p>
        <pre>
          <code>{simctl("robot shape plane --name ground", location.host)}</code>
        </pre>
        <h3>Move it</h3>
        <p>
          Each joint has a row in the panel: the handle of the slider is its target, the bar what the joint does. Drag a link in the picture to pull it. Space plays and pauses; ? shows all keys.
        </p>
        <h3>From a program</h3>
        <pre>
          <code>{PYTHON}</code>
        </pre>
      </div>
    </Sheet>
  );
}

const PYTHON = `import simd_client

with simd_client.connect() as sim:
    arm = sim.load("path/to/robot.urdf", fixed=True)
    arm.joints["elbow"].target = 0.5  # rad`;
