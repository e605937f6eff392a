// Guide to loading and moving a robot, with commands that reach this daemon.
import type { JSX } from "preact";
import { useEffect, useState } from "preact/hooks";
import { role } from "../state/world";
import { exampleOf, here, loadCommand, pythonProgram, simctl, type Reached } from "./commands";
import { shownRobot } from "./shown-robot";
import { zenohWay, type ZenohWay } from "./zenoh-way";

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
              {role.value !== "admin" && `, and yours has the role ${role.value}`}; <code>simctl token add NAME --role admin</code> makes one on the daemon’s machine.
            </>
          )}
        </p>
      )}
      <h3>Load a robot</h3>
      <p>
        Drop its folder, zip or file on the page, or press “Choose a folder” or “Choose a file”: the description (URDF, xacro, SDF or MJCF) with its meshes. The page finds the meshes by the rules of ROS (
        <code>package://</code> and relative paths), and the load report says what is missing or was repaired. The base of a robot is free unless its description or the sheet fixes it.
      </p>
      <Command text={loadCommand(to)} />
      <h3>Give it ground</h3>
      <p>The grid is only drawn. Free robots need something to stand on: “add ground” below the picture adds a plane, as this does:</p>
      <Command text={simctl("robot shape plane --name ground", to)} />
      <h3>Move it</h3>
      <p>Each joint has a row in the panel: the handle of the slider is its target, the bar its position. Drag a link in the picture to pull it. Space plays and pauses.</p>
      <Command text={simctl("robot list", to)} />
      <h3>From a program</h3>
      <Program to={to} />
    </div>
  );
}

/** A program in Python, and where the daemon is reached over Zenoh, which the program speaks. */
function Program({ to }: { to: Reached }): JSX.Element {
  const [way, setWay] = useState<ZenohWay | undefined>();
  useEffect(() => void zenohWay().then(setWay), []);
  return (
    <>
      <p data-testid="guide-zenoh" data-way={way?.kind}>
        {way?.kind === "off" ? (
          <>
            Programs in Python go by Zenoh, and this daemon was started without it. Start it without <code>--zenoh off</code>.
          </>
        ) : way?.kind === "near" ? (
          <>
            Programs in Python go by Zenoh, which is for the daemon’s own machine (<code>{way.locator}</code>). Run them there, or start the daemon with <code>--zenoh tcp/0.0.0.0:7447</code>.
          </>
        ) : (
          <>
            Programs in Python go by Zenoh{way && <> (<code>{way.locator}</code>)</>}, and ask this address where it is. Install the client in simd’s repository: <code>pip install ./client/python</code>
          </>
        )}
      </p>
      {way?.kind !== "off" && <Command text={pythonProgram(way?.kind === "near" ? { ...to, host: nearby(to.host) } : to, exampleOf(shownRobot.value))} />}
    </>
  );
}

/** Returns the address by which the daemon's own machine reaches it. */
function nearby(host: string): string {
  return host.replace(/^(\[.*\]|[^:]*)/, "127.0.0.1");
}

function Command({ text }: { text: string }): JSX.Element {
  return (
    <pre>
      <code data-testid="guide-command">{text}</code>
    </pre>
  );
}
