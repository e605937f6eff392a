// First actions, shown while the world is empty: load a robot, take the demo arm, or read how.
import { signal } from "@preact/signals";
import { Fragment, type JSX } from "preact";
import { addDemoArm } from "../daemon/actions";
import { copy as copyText } from "../state/clipboard";
import { whyNotAll } from "../state/permission";
import { here, loadCommand } from "./commands";
import { Icon } from "./icons";
import { OpenFile, OpenFolder } from "./OpenFiles";
import { helpOpen } from "./shortcuts";

const copied = signal(false);

/** A card in the middle of the view. */
export function EmptyWorld(): JSX.Element {
  const command = loadCommand(here());
  const copy = async (): Promise<void> => {
    copied.value = await copyText(command, "The line");
    setTimeout(() => {
      copied.value = false;
    }, 1500);
  };
  return (
    <section class="card empty" data-testid="empty-world">
      <h2>The world is empty</h2>
      <p>Drop a robot’s folder, zip or file here: URDF, xacro, SDF or MJCF with its meshes.</p>
      <div class="first-steps">
        <OpenFolder class="button primary">
          <Icon name="folder" /> Choose a folder
        </OpenFolder>
        <OpenFile>
          <Icon name="file" /> Choose a file
        </OpenFile>
        <button type="button" class="button" data-testid="add-demo-arm" disabled={whyNotAll.value !== ""} title={whyNotAll.value || "A small arm of five joints"} onClick={() => void addDemoArm()}>
          <Icon name="plus" /> Add the demo arm
        </button>
        <button
          type="button"
          class="button"
          data-testid="read-how"
          title="How to load robots, give them ground and move them"
          onClick={() => {
            helpOpen.value = "begin";
          }}
        >
          <Icon name="info" /> How to begin
        </button>
      </div>
      <p class="or">or from a shell</p>
      <div class="command">
        <code data-testid="load-command">
          {command.split(/ (?=--)/).map((part, index) => (
            <Fragment key={part}>
              {index > 0 && " "}
              <span>{part}</span>
            </Fragment>
          ))}
        </code>
        <button type="button" class="button quiet" aria-label="Copy the line" title="Copy the line" onClick={() => void copy()}>
          {copied.value ? "copied" : <Icon name="copy" />}
        </button>
      </div>
    </section>
  );
}
