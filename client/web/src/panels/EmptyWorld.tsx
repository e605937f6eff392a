// How to load a robot, shown while the world is empty.
import { signal } from "@preact/signals";
import { Fragment, type JSX } from "preact";
import { toast } from "../state/toasts";
import { loadCommand } from "./load-command";
import { Icon } from "./icons";
import { OpenFolder } from "./OpenFolder";

const copied = signal(false);

/** A card in the middle of the view. */
export function EmptyWorld(): JSX.Element {
  const command = loadCommand(location.host);
  const copy = async (): Promise<void> => {
    try {
      // Only pages over https or from this machine may write to the clipboard.
      await navigator.clipboard.writeText(command);
      copied.value = true;
      setTimeout(() => {
        copied.value = false;
      }, 1500);
    } catch {
      toast("info", "The browser does not let this page copy; select the line and copy it.");
    }
  };
  return (
    <section class="card empty" data-testid="empty-world">
      <h2>The world is empty</h2>
      <p>Drop a robot’s folder here: a URDF with its meshes.</p>
      <OpenFolder class="button primary">
        <Icon name="folder" /> Choose a folder
      </OpenFolder>
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
