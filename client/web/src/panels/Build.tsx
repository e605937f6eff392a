// The button of the menu for building, among the toggles below the picture.
import type { JSX } from "preact";
import { Icon } from "./icons";
import { lazy } from "./lazy";
import { Popover } from "./Popover";

const BuildMenu = lazy(async () => (await import("../build")).BuildMenu, "The menu");

export function Build(): JSX.Element {
  return (
    <Popover
      class="toggle"
      testId="build"
      label="build"
      title="Build: add, move, double and remove; undo; all robots; saved states; videos"
      face={
        <>
          <Icon name="build" />
          <span class="toggle-text">build</span>
        </>
      }
    >
      {(close) => <BuildMenu close={close} />}
    </Popover>
  );
}
