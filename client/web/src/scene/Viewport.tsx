// The world, drawn: a canvas that fills its parent.
import type { JSX } from "preact";

/** Shows the world and lets people look around in it. */
export function Viewport(): JSX.Element {
  return <div class="viewport" />;
}
