// Offers ground if robots have nothing to stand on.
import { useComputed } from "@preact/signals";
import type { JSX } from "preact";
import { addGround } from "../daemon/actions";
import { hasGround, scenes } from "../state/scene";
import { whyNotAll } from "../state/permission";
import { connection } from "../state/world";
import { Icon } from "./icons";

/** A button among the toggles; it states the reason if robots can fall. */
export function AddGround(): JSX.Element | null {
  const isNeeded = useComputed(() => !hasGround.value && scenes.value.size > 0 && connection.value.state === "live").value;
  const canFall = useComputed(() => [...scenes.value.values()].some(({ links }) => links[0]?.movable === true)).value;
  if (!isNeeded || whyNotAll.value !== "") return null;
  return (
    <button
      type="button"
      class={canFall ? "toggle needed" : "toggle"}
      data-testid="add-ground"
      aria-label={canFall ? undefined : "add ground"}
      title="Only robots collide here; the grid is just drawn. Add a plane at z = 0, for all clients"
      onClick={() => void addGround()}
    >
      <Icon name="ground" />
      <span>{canFall ? "nothing to stand on: add ground" : <span class="toggle-text">add ground</span>}</span>
    </button>
  );
}
