// Size of the page as an attribute of the root element. Queries of the window's size ignore larger text.
import { computed, effect, signal, type ReadonlySignal } from "@preact/signals";
import { shownTextSize } from "./text-size";

/** "tall" is an upright phone, with its panel below the picture; "short" a phone on its side, or a window with large text. */
export type Room = "wide" | "tall" | "short";

/** Widths and heights in pixels, of text of 100 %. */
const NARROW = 760;
const LOW = 480;
/** The narrowest page on which picture and panel are side by side. */
const MIN_SIDE_BY_SIDE = 480;

export function roomOf(width: number, height: number, textPercent: number): Room {
  const [wide, high] = [(100 * width) / textPercent, (100 * height) / textPercent];
  if (high < LOW && wide >= MIN_SIDE_BY_SIDE && wide > high) return "short";
  return wide <= NARROW ? "tall" : "wide";
}

const size = signal<readonly [number, number]>([innerWidth, innerHeight]);
addEventListener("resize", () => {
  size.value = [innerWidth, innerHeight];
});

export const room: ReadonlySignal<Room> = computed(() => roomOf(...size.value, Number(shownTextSize.value)));

effect(() => {
  document.documentElement.dataset["room"] = room.value;
});
