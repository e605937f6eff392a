// A link that restores this page's view: the camera, the robot of the panel, the layers and the plots.
import { shownCamera } from "./camera";
import { kept, type Kept } from "./view";

/** Settings that belong to each user. */
const PERSONAL: ReadonlySet<string> = new Set(["theme", "textSize", "quality", "panelWidth"]);
const KEY = "view";
/** Maximum number of characters of a link that are read. */
const LONGEST = 20_000;
/** Digits of a camera's coordinates. */
const DIGITS = 5;

/** Returns the address of the page in its present state. `address` is the page's address, `robot` the panel's robot. */
export function linkTo(address: string, robot: string): string {
  const shown: Record<string, unknown> = {};
  for (const [name, { value, initial }] of scene()) {
    const now = value.peek();
    if (JSON.stringify(now) !== JSON.stringify(initial)) shown[name] = now;
  }
  // The link also names a robot that the user has not chosen.
  if (robot !== "") shown["selectedRobot"] = robot;
  const camera = shownCamera.peek();
  const rounded = (numbers: readonly number[]) => numbers.map((number) => Number(number.toPrecision(DIGITS)));
  if (camera) shown["camera"] = [rounded(camera.position), rounded(camera.target)];
  const url = new URL(address);
  url.hash = new URLSearchParams({ [KEY]: JSON.stringify(shown) }).toString();
  return url.href;
}

/** Applies a link from the part of its address behind `#`. Returns whether it was such a link; unreadable parts change nothing. */
export function followLink(hash: string): boolean {
  const text = hash.length <= LONGEST ? new URLSearchParams(hash.replace(/^#/, "")).get(KEY) : null;
  if (text === null) return false;
  let said: unknown;
  try {
    said = JSON.parse(text);
  } catch {
    return true;
  }
  if (typeof said !== "object" || said === null) return true;
  for (const [name, { value, initial, isValid }] of scene()) {
    const wanted: unknown = Object.hasOwn(said, name) ? (said as Record<string, unknown>)[name] : initial;
    if (isValid(wanted)) value.value = wanted;
  }
  return true;
}

function scene(): [string, Kept][] {
  return [...kept].filter(([name]) => !PERSONAL.has(name));
}

/** Follows the link by which the page was opened, and links that are entered later. Afterwards the address is again the page's. */
export function followLinks(): void {
  if (followLink(location.hash)) history.replaceState(null, "", location.pathname + location.search);
  // The camera is read once.
  addEventListener("hashchange", () => location.reload());
}
