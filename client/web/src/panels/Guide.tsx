// Guide to loading and moving a robot, with commands that reach this daemon.
import type { JSX } from "preact";
import { role } from "../state/world";
import { here, loadCommand, pythonProgram, simctl } from "./commands";

/** A part of the help. */
export function Guide(): JSX.Element {
  const to = here();
  return (
    <div class="guide" data-testid="guide">
      {(to.isTls || to.asksToken) && (
        <p>
          {to.isTls && (
            <>
              This daemon speaks TLS: <code>ca.pem</code> below is the authority that signed its certificate.{" "}
            </>
          )}
          {to.asksToken && (
            <>
              It asks for a token: <code>token.txt</code> has it in its first line. Loading needs a token with the role admin
              {role.value !== "admin" && `, and yours has the role ${role.value}`}; <code>simctl token add NAME --role admin</code> makes one where the daemon runs.
            </>
          )}
        </p>
      )}
      <h3>Load a robot</h3>
      <p>
        Drop its folder, zip or file on the page, or press “Choose a folder” or “Choose a file”: the description (URDF, xacro, SDF or MJCF) with its meshes. The page finds the meshes by the rules of ROS (
        <code>package://</code> and relative paths), and the load report says what is missing or was repaired. What is dropped has a fixed base; <code>simctl</code> has all options.
      </p>
      <Command text={loadCommand(to)} />
      <h3>Give it ground</h3>
      <p>The grid is only drawn. Free robots need something to stand on: “add ground” below the picture adds a plane, as this does:</p>
      <Command text={simctl("robot shape plane --name ground", to)} />
      <h3>Move it</h3>
      <p>Each joint has a row in the panel: the handle of the slider is its target, the bar what the joint does. Drag a link in the picture to pull it. Space plays and pauses.</p>
      <Command text={simctl("robot list", to)} />
      <h3>From a program</h3>
      <p>
        Programs in Python go by Zenoh, whose port is 7447 unless the operator chose another. Where Zenoh is only for the daemon’s own machine, run them there. <code>pip install simd-client</code>
      </p>
      <Command text={pythonProgram(to)} />
    </div>
  );
}

function Command({ text }: { text: string }): JSX.Element {
  return (
    <pre>
      <code data-testid="guide-command">{text}</code>
    </pre>
  );
}
